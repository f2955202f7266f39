#include "io/model_writer.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "core/scene/polygon.hpp"
#include "io/element_polygons.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

namespace {

/// A square metre of floor (reflectance 1/2) and beside it a half-disc, lit by irradiance 2 x on the front.
Solution lit_floor() {
  auto scene = std::make_shared<Scene>();
  scene->materials.resize(2);
  scene->materials[0].name = "floor, \"oak\"";
  scene->materials[1].name = "lamp";
  scene->materials[1].radiance = Rgb{1};
  Surface square;
  square.corners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.area = 1;
  scene->surfaces.push_back(square);
  Surface disc;
  for (int i = 0; i <= 8; ++i)
    disc.corners.push_back({1 + std::sin(i * std::numbers::pi / 8), 0.5 - 0.5 * std::cos(i * std::numbers::pi / 8), 0});
  disc.area = area(disc.corners);
  disc.material = 1;
  scene->surfaces.push_back(disc);
  scene->file_frame = {0.001, true};
  Solution solution;
  solution.options.mesh.patch_size = 0.3;
  solution.scene = scene;
  const std::vector<LitSides> lit{{true, false}, {true, false}};
  solution.mesh = std::make_shared<const Mesh>(mesh_of(*scene, solution.options.mesh, lit));
  for (const Patch& patch : solution.mesh->patches)
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const Vec3 p = solution.mesh->planes[patch.plane.value].point(solution.mesh->elements[e].centre);
      solution.irradiance.push_back(Rgbf{static_cast<float>(2 * p.x)});
    }
  solution.direct_irradiance.assign(solution.irradiance.size(), Rgbf{0.f});
  return solution;
}

}  // namespace

TEST_SUITE("io") {
  TEST_CASE("element_polygons: the polygons have the elements' areas and cover the surfaces") {
    const Solution solution = lit_floor();
    const Mesh& mesh = *solution.mesh;
    double sum = 0;
    for (const Patch& patch : mesh.patches)
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
        const double polygon_area = signed_area(mesh.element_polygon(patch, mesh.elements[e]));
        CHECK(polygon_area == doctest::Approx(mesh.elements[e].area).epsilon(1e-5));
        sum += polygon_area;
      }
    CHECK(sum == doctest::Approx(1 + solution.scene->surfaces[1].area).epsilon(1e-6));
  }

  TEST_CASE("element_polygons: corners inside a wall carry the mean of the elements around them") {
    const Solution solution = lit_floor();
    const ElementModel model = element_model(solution);
    int inner = 0;
    for (const ElementModel::Vertex& vertex : model.vertices) {
      const Vec3 p = vertex.position;
      if (p.x < 0.05 || p.x > 0.95 || p.y < 0.05 || p.y > 0.95) continue;
      // Irradiance 2 x is linear, so the mean of four equal neighbours is exact: radiosity = 1/2 of it.
      CHECK(vertex.radiosity.x == doctest::Approx(p.x).epsilon(0.02));
      CHECK(vertex.normal == Vec3{0, 0, 1});
      ++inner;
    }
    CHECK(inner > 10);
    // Where floor and lamp meet, each keeps its own colour.
    int floor_corners = 0, lamp_corners = 0;
    for (const ElementModel::Vertex& vertex : model.vertices)
      if (std::abs(vertex.position.x - 1) < 1e-9)
        (vertex.radiosity.x > std::numbers::pi ? lamp_corners : floor_corners)++;
    CHECK(floor_corners >= 4);
    CHECK(lamp_corners >= 2);
  }

  TEST_CASE("model_writer: csv has one row an element, in the scene's unit and axes") {
    const ScratchFolder folder;
    const Solution solution = lit_floor();
    REQUIRE(write_model(folder / "m.csv", solution));
    std::istringstream lines(folder.read("m.csv"));
    std::string line;
    std::getline(lines, line);
    CHECK(line == "x,y,z,nx,ny,nz,area,Er,Eg,Eb,Br,Bg,Bb,material");
    std::getline(lines, line);
    double v[13];
    REQUIRE(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", v, v + 1, v + 2, v + 3,
                        v + 4, v + 5, v + 6, v + 7, v + 8, v + 9, v + 10, v + 11, v + 12) == 13);
    CHECK(v[0] > 1);   // millimetres
    CHECK(v[4] == 1);  // y up
    CHECK(v[7] == doctest::Approx(2 * v[0] / 1000));
    CHECK(v[10] == doctest::Approx(v[7] / 2));
    CHECK(line.find(",\"floor, \"\"oak\"\"\"") != std::string::npos);
    std::size_t rows = 1;
    while (std::getline(lines, line)) ++rows;
    CHECK(rows == solution.mesh->elements.size());
  }

  TEST_CASE("model_writer: ply has as many bytes as its header says") {
    const ScratchFolder folder;
    const Solution solution = lit_floor();
    const ElementModel model = element_model(solution);
    REQUIRE(write_model(folder / "m.ply", solution));
    const std::string text = folder.read("m.ply");
    const std::size_t data = text.find("end_header\n") + 11;
    CHECK(text.find("element vertex " + std::to_string(model.vertices.size()) + "\n") < data);
    CHECK(text.find("element face " + std::to_string(model.faces.size()) + "\n") < data);
    CHECK(text.size() - data == model.vertices.size() * (24 + 3 + 12) + model.faces.size() + 4 * model.corners.size());
    double position[3];
    std::memcpy(position, text.data() + data, sizeof position);
    CHECK(position[0] == doctest::Approx(1000 * model.vertices[0].position.x));
  }

  TEST_CASE("model_writer: glb is glTF 2.0 whose views and accessors fit its buffer") {
    const ScratchFolder folder;
    const Solution solution = lit_floor();
    REQUIRE(write_model(folder / "m.glb", solution));
    const std::string bytes = folder.read("m.glb");
    std::uint32_t word[5];
    REQUIRE(bytes.size() > 28);
    std::memcpy(word, bytes.data(), sizeof word);
    CHECK(bytes.substr(0, 4) == "glTF");
    CHECK(word[1] == 2);
    CHECK(word[2] == bytes.size());
    const auto json = nlohmann::json::parse(bytes.substr(20, word[3]));
    std::uint32_t buffer_bytes;
    std::memcpy(&buffer_bytes, bytes.data() + 20 + word[3], 4);
    CHECK(json["buffers"][0]["byteLength"] == buffer_bytes);
    CHECK(20 + word[3] + 8 + buffer_bytes == bytes.size());
    for (const auto& view : json["bufferViews"])
      CHECK(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>() <= buffer_bytes);
    const auto& primitives = json["meshes"][0]["primitives"];
    REQUIRE(primitives.size() == 2);
    CHECK(json["materials"][0]["name"] == "floor, \"oak\"");
    CHECK(json["materials"][0]["extensions"].contains("KHR_materials_unlit"));
    const auto& positions = json["accessors"][primitives[0]["attributes"]["POSITION"].get<int>()];
    CHECK(positions["count"] == element_model(solution).vertices.size());
    CHECK(positions["max"][1].get<double>() == doctest::Approx(0));  // y up, about the model's middle
    CHECK(positions["max"][0].get<double>() == doctest::Approx(1));
    const auto& colours = json["accessors"][primitives[0]["attributes"]["COLOR_0"].get<int>()];
    CHECK(colours["normalized"] == true);
    CHECK(colours["componentType"] == 5123);
  }

  TEST_CASE("model_writer: what can't be written is one clear line") {
    const ScratchFolder folder;
    check_error(write_model(folder / "m.fbx", lit_floor()), folder / "m.fbx", ".glb, .ply and .csv");
    for (const char* name : {"m.csv", "m.ply", "m.glb"}) {
      check_error(write_model(folder / (std::string("no/") + name), lit_floor()), folder / (std::string("no/") + name),
                  "No such file");
      std::filesystem::create_symlink("/dev/full", folder / name);
      check_error(write_model(folder / name, lit_floor()), folder / name, "No space left");
    }
  }
}
