#include "io/mtl_reader.hpp"

#include <tiny_obj_loader.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <sstream>

#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr std::uint64_t largest_file = 64u << 20;
constexpr double largest_radiance = 1e12;

/// Values that were given at all; tinyobjloader's defaults don't tell.
struct Given {
  bool specular = false, exponent = false, illum = false, index = false, reflectance = false;
};

struct Block {
  MtlMaterial head;
  Given given;
};

/// The lines that matter, checked, in a form tinyobjloader can't misread.
struct CheckedText {
  std::string text;
  std::vector<Block> blocks;
};

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// `Kd r g b`, or `Kd v` for grey.
Expected<std::string> checked_colour(std::string_view key, std::string_view rest, const std::string& where,
                                     double largest) {
  double values[3] = {};
  int count = 0;
  for (std::string_view word = next_word(rest); !word.empty() && count < 3; word = next_word(rest)) {
    if (!parse_number(word, values[count++]))
      return bad_input(where, std::string(key) + " expects three numbers, found " + in_quotes(word));
  }
  if (count == 1) values[1] = values[2] = values[0];
  if (count != 1 && count != 3) return bad_input(where, std::string(key) + " expects three numbers");
  std::string line(key);
  for (const double value : values) {
    if (!std::isfinite(value)) return bad_input(where, std::string(key) + " is not a finite number");
    if (value < 0) return bad_input(where, std::string(key) + " is negative: " + shown(value));
    if (value > largest) return bad_input(where, std::string(key) + " is too large: " + shown(value));
    line += " " + shortest_number(value);
  }
  return line + "\n";
}

Expected<std::string> checked_scalar(std::string_view key, std::string_view rest, const std::string& where) {
  const std::string_view word = next_word(rest);
  double value = 0;
  if (!parse_number(word, value))
    return bad_input(where, std::string(key) + " expects a number, found " + in_quotes(word));
  if (!std::isfinite(value) || value < 0 || value > 1e6)
    return bad_input(where, std::string(key) + " must be between 0 and 1e6, found " + in_quotes(word));
  return std::string(key) + " " + shortest_number(key == "illum" ? std::round(value) : value) + "\n";
}

/// One line of a material; unknown keys are left out, they carry nothing we use.
Expected<std::string> checked_line(std::string_view key, std::string_view rest, const std::string& where,
                                   std::uint32_t number, Block& block) {
  if (key == "Kd" || key == "Ks" || key == "Ke") {
    if (key == "Kd") block.given.reflectance = true, block.head.reflectance_line = number;
    if (key == "Ks") block.given.specular = true;
    return checked_colour(key, rest, where, key == "Ke" ? largest_radiance : 1e3);
  }
  if (key == "Ns" || key == "Ni" || key == "illum") {
    (key == "Ns" ? block.given.exponent : key == "Ni" ? block.given.index : block.given.illum) = true;
    return checked_scalar(key, rest, where);
  }
  if (key == "map_Kd") {
    block.head.texture_line = number;
    if (trimmed(rest).empty()) return bad_input(where, "map_Kd expects the name of an image file");
    return "map_Kd " + std::string(trimmed(rest)) + "\n";
  }
  return std::string();
}

Expected<CheckedText> checked_text(const std::string& path, ImportReport& report) {
  Expected<std::string> text = file_text(path, largest_file);
  if (!text) return text.error();
  CheckedText checked;
  std::map<std::string, std::uint32_t, std::less<>> names;
  Lines lines(std::move(*text), true);
  bool skipping = false;
  while (lines.next()) {
    std::string_view rest = lines.line();
    const std::string_view key = next_word(rest);
    if (key.empty() || key.starts_with('#')) continue;
    const std::string where = at_line(path, lines.number());
    if (key == "newmtl") {
      const std::string name(trimmed(rest));
      if (name.empty()) return bad_input(where, "newmtl expects a name");
      const auto [first, is_new] = names.try_emplace(name, lines.number());
      skipping = !is_new;
      if (skipping) {
        report.note("material defined twice", where + ": material " + in_quotes(name) + " is defined twice; line " +
                                                  std::to_string(first->second) + " counts");
        continue;
      }
      checked.blocks.emplace_back();
      checked.blocks.back().head.material.name = name;
      checked.blocks.back().head.line = checked.blocks.back().head.reflectance_line = lines.number();
      // The number stands for the name: tinyobjloader cuts some names short.
      checked.text += "newmtl " + std::to_string(checked.blocks.size()) + "\n";
      continue;
    }
    if (skipping) continue;
    if (checked.blocks.empty()) {
      static constexpr std::string_view known[] = {"Kd",    "Ks",     "Ke", "Ka", "Ns", "Ni",
                                                   "illum", "map_Kd", "d",  "Tr", "Tf"};
      if (std::find(std::begin(known), std::end(known), key) != std::end(known))
        return bad_input(where, in_quotes(key) + " stands before the first newmtl");
      continue;
    }
    const Expected<std::string> line = checked_line(key, rest, where, lines.number(), checked.blocks.back());
    if (!line) return line.error();
    checked.text += *line;
  }
  return checked;
}

Finish finish_of(const Material& material, const Given& given, int illum) {
  if (given.illum && illum >= 4 && illum <= 7) return Finish::glass;
  const bool specular = max_channel(material.specular) > 0;
  if (given.illum && illum == 3 && specular) return Finish::mirror;
  if (specular && material.exponent > 0 && (!given.illum || illum >= 2)) return Finish::glossy;
  return Finish::diffuse;
}

/// Turns what tinyobjloader read into our material.
MtlMaterial material_of(const tinyobj::material_t& read, const Block& block) {
  MtlMaterial result = block.head;
  Material& material = result.material;
  material.reflectance = {read.diffuse[0], read.diffuse[1], read.diffuse[2]};
  // Without Kd a texture is meant as it is; without both the usual middle grey of viewers stands in.
  if (!block.given.reflectance) material.reflectance = Rgb{read.diffuse_texname.empty() ? 0.5 : largest_reflectance};
  material.radiance = {read.emission[0], read.emission[1], read.emission[2]};
  if (block.given.specular) material.specular = {read.specular[0], read.specular[1], read.specular[2]};
  if (block.given.exponent) material.exponent = read.shininess;
  if (block.given.index && read.ior >= 1) material.refractive_index = read.ior;
  material.finish = finish_of(material, block.given, read.illum);
  result.texture_file = read.diffuse_texname;
  std::replace(result.texture_file.begin(), result.texture_file.end(), '\\', '/');
  return result;
}

}  // namespace

Expected<std::vector<MtlMaterial>> read_mtl(const std::string& path, ImportReport& report) {
  const Expected<CheckedText> checked = checked_text(path, report);
  if (!checked) return checked.error();
  std::vector<MtlMaterial> materials;
  if (checked->blocks.empty()) return materials;

  std::map<std::string, int> names;
  std::vector<tinyobj::material_t> read;
  std::istringstream stream(checked->text);
  std::string warning, problem;
  tinyobj::LoadMtl(&names, &read, &stream, &warning, &problem);
  if (read.size() != checked->blocks.size()) return bad_input(path, "could not be read as a material file");

  for (std::size_t i = 0; i < read.size(); ++i) {
    const Block& block = checked->blocks[i];
    materials.push_back(material_of(read[i], block));
    clamp_reflectance(materials.back().material, at_line(path, block.head.reflectance_line), report);
  }
  return materials;
}

void clamp_reflectance(Material& material, const std::string& where, ImportReport& report) {
  const double diffuse = max_channel(material.reflectance);
  if (diffuse > largest_reflectance) {
    material.reflectance *= largest_reflectance / diffuse;
    report.note("reflectance too large", where + ": material " + in_quotes(material.name) + " reflects " +
                                             shown(diffuse) + " of the light (Kd); scaled to " +
                                             shown(largest_reflectance));
  }
  if (material.finish != Finish::glossy && material.finish != Finish::mirror) return;
  const double both = max_channel(material.reflectance + material.specular);
  if (both <= 1) return;
  // The diffuse part stays: it is what the first pass sees.
  for (int channel = 0; channel < 3; ++channel)
    material.specular[channel] = std::min(material.specular[channel], 1 - material.reflectance[channel]);
  report.note("reflectance too large", where + ": material " + in_quotes(material.name) + " reflects " + shown(both) +
                                           " of the light (Kd + Ks); Ks was lowered");
}

bool is_valid_colour(const Rgb& colour) {
  return all_finite(colour) && colour.x >= 0 && colour.y >= 0 && colour.z >= 0;
}

}  // namespace lichthof::io
