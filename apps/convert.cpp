/// `lichthof convert`: between formats of scenes, and of pictures.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/common/files.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"
#include "apps/common/report.hpp"
#include "io/image_writer.hpp"
#include "io/scene_reader.hpp"
#include "io/scene_writer.hpp"

namespace lichthof::apps {

namespace {

struct ConvertOptions {
  std::string input, output;
  io::ReadOptions read, write;
  std::optional<double> exposure_ev;
  OutputOptions talk;
};

const std::vector<std::string> scene_endings{".obj", ".toml"}, picture_endings{".exr", ".hdr", ".png"};

bool is_one_of(const std::vector<std::string>& endings, const std::string& path) {
  return std::find(endings.begin(), endings.end(), ending_of(path)) != endings.end();
}

nlohmann::json document(const ConvertOptions& options, const Stopwatch& total) {
  return {{"command", "convert"},
          {"version", LICHTHOF_VERSION},
          {"input", options.input},
          {"output", options.output},
          {"seconds", {{"total", total.seconds()}}},
          {"peak_memory_bytes", peak_memory_bytes()}};
}

Status convert_picture(const ConvertOptions& options, const Stopwatch& total) {
  const Expected<io::Image> image = io::read_image(options.input);
  if (!image) return image.error();
  const Interruption::Deferral deferral;
  if (Status written = io::write_image(options.output, image->view(), {options.exposure_ev}); !written) return written;
  nlohmann::json report = document(options, total);
  report["width"] = image->width;
  report["height"] = image->height;
  return print(
      options.talk, report,
      {options.output + ": " + std::to_string(image->width) + "x" + std::to_string(image->height) + " pixels"});
}

Status convert_scene(const ConvertOptions& options, const Stopwatch& total) {
  const Expected<io::LoadedScene> loaded = io::read_scene(options.input, options.read);
  if (!loaded) return loaded.error();
  // Metres and z up are what every reader assumes; an OBJ file has no place to say otherwise.
  const Expected<FileFrame> frame = io::frame_with({}, options.write);
  if (!frame) return frame.error();
  const Interruption::Deferral deferral;
  if (Status written = io::write_scene(options.output, loaded->scene, *frame); !written) return written;
  nlohmann::json report = document(options, total);
  report["import"] = loaded->report.json();
  std::vector<std::string> lines = loaded->report.text();
  lines.push_back(options.output + ": " + grouped(loaded->scene.surfaces.size()) + " surfaces");
  return print(options.talk, report, lines);
}

Status convert(const ConvertOptions& options) {
  const Stopwatch total;
  log_as_asked(options.talk);
  const bool is_picture = is_one_of(picture_endings, options.input);
  if (Status ready = output_ready(options.output, is_picture ? picture_endings : scene_endings, {options.input});
      !ready)
    return ready;
  return is_picture ? convert_picture(options, total) : convert_scene(options, total);
}

}  // namespace

void add_convert(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App& command = *program.add_subcommand("convert", "convert a scene or a picture into another format");
  command.add_option("IN", options->input, "a scene (.obj, .toml) or a picture (.exr, .hdr, .png)")
      ->required()
      ->option_text(" ");
  command.add_option("-o,--output", options->output, "the same in another format")->required()->option_text("OUT");
  add_scene_options(command, options->read);
  command.add_option("--to-unit", options->write.unit, "unit of the numbers to write (default m)")
      ->check(one_of({"mm", "cm", "m", "in", "ft"}))
      ->option_text("UNIT");
  command.add_option("--to-up", options->write.up, "axis that points up in OUT: y or z (default z)")
      ->check(one_of({"y", "z"}))
      ->option_text("AXIS");
  add_exposure_option(command, options->exposure_ev, "a .png");
  add_output_options(command, options->talk);
  command.footer(
      "A .toml scene also keeps cameras, unit and up axis; beside it stand an .obj and an .mtl of the same name.\n"
      "What was odd about the scene and what became of it is reported.\n"
      "\nExamples:\n"
      "  lichthof convert room_mm.obj --unit mm --up y -o room.toml\n"
      "  lichthof convert room.exr -o room.png --exposure 2");
  command.callback([options, &chosen] { chosen = [options](Interruption&) { return convert(*options); }; });
}

}  // namespace lichthof::apps
