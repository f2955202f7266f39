/// Every documented command on a small room: what it prints, what it writes, how it ends.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "io/image_writer.hpp"
#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

/// The keys that the contract promises, each with a number that makes sense.
void expect_run_report(const nlohmann::json& report) {
  for (const char* key :
       {"elements", "patches", "cells", "nodes", "shots", "rays", "bytes_sent", "peak_memory_bytes"}) {
    INFO(key);
    REQUIRE(report.contains(key));
    CHECK(report[key].is_number_unsigned());
  }
  for (const char* key : {"load", "mesh", "radiosity", "rays", "total"}) {
    INFO(key);
    REQUIRE(report["seconds"].contains(key));
    CHECK(report["seconds"][key].get<double>() >= 0);
  }
  for (const char* key : {"emitted", "absorbed", "escaped", "unshot", "residual"}) {
    INFO(key);
    REQUIRE(report["energy"].contains(key));
    CHECK(report["energy"][key].is_number());
  }
  CHECK(report.contains("error_estimate"));
  CHECK(report["seconds"]["total"].get<double>() >= report["seconds"]["radiosity"].get<double>());
  CHECK(report["peak_memory_bytes"].get<double>() > 1e6);
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("lichthof: help and version are on stdout, with examples") {
    const Outcome help = ran({"--help"});
    CHECK(help.status == 0);
    for (const std::string command : {"render", "solve", "probe", "export", "convert", "doctor", "bench"}) {
      CHECK(help.out.find(command) != std::string::npos);
      const Outcome own = ran({command, "--help"});
      CHECK(own.status == 0);
      CHECK(own.err.empty());
      CHECK(own.out.find("lichthof " + command + " ") != std::string::npos);
      for (const char* option : {"--json", "--quiet", "--verbose", "--version"})
        CHECK(own.out.find(option) != std::string::npos);
    }
    const Outcome version = ran({"render", "--version"});
    CHECK(version.status == 0);
    CHECK(version.out.starts_with("lichthof "));
  }

  TEST_CASE("render: a scene becomes a picture in each format, and a summary") {
    const Folder folder;
    write_room(folder);
    const Outcome outcome =
        ran({"render", folder / "room.toml", "-o", folder / "room.exr", "--size", "64x48", "--elements", "1200"});
    CHECK(outcome.status == 0);
    CHECK(outcome.err.empty());
    CHECK(outcome.out.find("room.exr: 64x48") != std::string::npos);
    const Expected<io::Image> image = io::read_image(folder / "room.exr");
    REQUIRE(image);
    CHECK(image->width == 64);
    CHECK(image->height == 48);
    double sum = 0;
    for (const float value : image->rgb) {
      CHECK(std::isfinite(value));
      sum += value;
    }
    CHECK(sum / static_cast<double>(image->rgb.size()) > 0.1);

    const Outcome json = ran({"render", folder / "room.obj", "-o", folder / "room.png", "--size", "32x24", "--elements",
                              "800", "--camera", "3.8,0.2,1.6; 0.5,2.5,0.8; 0,0,1; 60", "--solution",
                              folder / "room.lht", "--cells", "2x1", "--json"});
    CHECK(json.status == 0);
    const nlohmann::json report = json.json();
    expect_run_report(report);
    CHECK(report["cells"] == 2);
    CHECK(report["nodes"] == 1);
    CHECK(report["shots"].get<int>() > 0);
    CHECK(report["bytes_sent"].get<int>() > 0);
    CHECK(report["import"]["emitters"] == 1);
    CHECK(folder.has("room.png"));
    CHECK(folder.has("room.lht"));
    CHECK(ran({"render", folder / "room.lht", "-o", folder / "again.hdr", "--size", "16x12", "--quiet"}).out.empty());
    CHECK(folder.has("again.hdr"));
  }

  TEST_CASE("render: every method makes a picture of about the same brightness") {
    const Folder folder;
    write_room(folder);
    double two_pass = 0;
    for (const std::string method : {"two-pass", "radiosity", "hemicube", "raytrace", "reference"}) {
      INFO(method);
      const std::string path = folder / (method + ".exr");
      std::vector<std::string> arguments{"render", folder / "room.toml", "-o",     path,     "--method",
                                         method,   "--camera",           "window", "--size", "24x18"};
      if (method != "raytrace" && method != "reference") arguments.insert(arguments.end(), {"--elements", "800"});
      const Outcome outcome = ran(arguments);
      CHECK(outcome.status == 0);
      const Expected<io::Image> image = io::read_image(path);
      REQUIRE(image);
      double sum = 0;
      for (const float value : image->rgb) sum += value;
      if (method == "two-pass") two_pass = sum;
      CHECK(std::abs(sum / two_pass - 1) < (method == "raytrace" ? 0.5 : 0.1));
    }
  }

  TEST_CASE("solve, probe, export: one solution serves all") {
    const Folder folder;
    write_room(folder);
    const std::string points = folder.write("points.csv", room_points());
    const Outcome solved =
        ran({"solve", folder / "room.obj", "-o", folder / "room.lht", "--elements", "1200", "--json"});
    CHECK(solved.status == 0);
    expect_run_report(solved.json());
    CHECK(solved.json()["converged"] == true);

    const Outcome probed = ran({"probe", folder / "room.lht", "--points", points, "-o", folder / "out.csv", "--json"});
    CHECK(probed.status == 0);
    expect_run_report(probed.json());
    const auto rows = results_of(folder / "out.csv");
    CHECK(rows.size() == 50);
    CHECK(contents(folder / "out.csv").starts_with("x,y,z,nx,ny,nz,Er,Eg,Eb\n0.3,0.2,0,0,0,1,"));
    for (const auto& row : rows) {
      REQUIRE(row.size() == 3);
      for (const double value : row) CHECK(value > 0);
    }

    CHECK(ran({"probe", folder / "room.lht", "--points", points, "-o", folder / "lux.csv", "--photometric"}).status ==
          0);
    const auto lux = results_of(folder / "lux.csv");
    REQUIRE(lux.size() == rows.size());
    CHECK(lux[7][0] ==
          doctest::Approx(179 * (0.2126 * rows[7][0] + 0.7152 * rows[7][1] + 0.0722 * rows[7][2])).epsilon(1e-6));

    for (const std::string name : {"room.glb", "room.ply", "room.csv"}) {
      const Outcome outcome = ran({"export", folder / "room.lht", "-o", folder / name});
      CHECK(outcome.status == 0);
      CHECK(contents(folder / name).size() > 1000);
    }
    CHECK(ran({"export", folder / "room.lht", "-o", folder / "room.glb", "--json"}).json()["elements"] ==
          solved.json()["elements"]);
  }

  TEST_CASE("probe: methods agree, and the reference tells its standard error") {
    const Folder folder;
    write_room(folder);
    const std::string points = folder.write("points.csv", room_points());
    CHECK(ran({"solve", folder / "room.obj", "-o", folder / "room.lht", "--elements", "3000"}).status == 0);
    const Outcome reference = ran({"probe", folder / "room.lht", "--points", points, "-o", folder / "reference.csv",
                                   "--method", "reference", "--samples", "4096", "--json"});
    CHECK(reference.status == 0);
    CHECK(reference.json()["standard_error"].get<double>() < 0.03);
    const auto truth = results_of(folder / "reference.csv");
    for (const std::vector<std::string>& extra :
         {std::vector<std::string>{}, {"--gather", "0"}, {"--method", "radiosity"}, {"--gather", "1024"}}) {
      std::vector<std::string> arguments{"probe", folder / "room.lht", "--points", points, "-o", folder / "out.csv"};
      arguments.insert(arguments.end(), extra.begin(), extra.end());
      CHECK(ran(arguments).status == 0);
      const auto rows = results_of(folder / "out.csv");
      double difference = 0, whole = 0;
      for (std::size_t i = 0; i < truth.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
          difference += std::pow(rows[i][c] - truth[i][c], 2), whole += std::pow(truth[i][c], 2);
      INFO("relative RMS " << std::sqrt(difference / whole));
      // 3000 elements: the first pass alone knows the room within some percent.
      CHECK(std::sqrt(difference / whole) < 0.08);
    }
  }

  TEST_CASE("units: a scene in millimetres with y up is the same scene") {
    const Folder folder;
    write_room(folder);
    CHECK(ran({"convert", folder / "room.toml", "-o", folder / "mm.obj", "--to-unit", "mm", "--to-up", "y"}).status ==
          0);
    const std::string points = folder.write("points.csv", "x,y,z,nx,ny,nz\n2,1,0,0,0,1\n3,2,1,0,0,1\n");
    const std::string points_mm =
        folder.write("points_mm.csv", "x,y,z,nx,ny,nz\n2000,0,-1000,0,1,0\n3000,1000,-2000,0,1,0\n");
    CHECK(ran({"probe", folder / "room.obj", "--points", points, "-o", folder / "a.csv", "--patch", "0.5"}).status ==
          0);
    const Outcome outcome = ran({"probe", folder / "mm.obj", "--points", points_mm, "-o", folder / "b.csv", "--patch",
                                 "500", "--unit", "mm", "--up", "y"});
    CHECK(outcome.status == 0);
    const auto metres = results_of(folder / "a.csv"), millimetres = results_of(folder / "b.csv");
    for (std::size_t i = 0; i < 2; ++i) CHECK(millimetres[i][1] == doctest::Approx(metres[i][1]).epsilon(0.01));
  }

  TEST_CASE("convert: scenes and pictures") {
    const Folder folder;
    write_room(folder);
    const Outcome scene = ran({"convert", folder / "room.toml", "-o", folder / "copy.toml", "--json"});
    CHECK(scene.status == 0);
    CHECK(scene.json()["import"]["surfaces_made"] == 12);
    for (const char* name : {"copy.toml", "copy.obj", "copy.mtl"}) CHECK(folder.has(name));
    CHECK(ran({"render", folder / "copy.toml", "-o", folder / "a.exr", "--size", "16x12", "--elements", "400",
               "--camera", "window"})
              .status == 0);
    CHECK(ran({"convert", folder / "a.exr", "-o", folder / "a.png", "--exposure", "0"}).status == 0);
    const Expected<io::Image> picture = io::read_image(folder / "a.png");
    REQUIRE(picture);
    CHECK(picture->width == 16);
  }

  TEST_CASE("doctor: this machine is well") {
    const Outcome outcome = ran({"doctor", "--json"});
    CHECK(outcome.status == 0);
    const nlohmann::json report = outcome.json();
    CHECK(report["good"] == true);
    CHECK(report["checks"].size() >= 6);
    const Outcome lines = ran({"doctor"});
    CHECK(lines.out.find("cpu") != std::string::npos);
    CHECK(lines.out.find("solver") != std::string::npos);
  }

  TEST_CASE("keys: an authority, a certificate, and what stands in them") {
    const Folder folder;
    const std::string keys = folder / "keys";
    CHECK(ran({"keys", "init", keys}).out.find("ca.key") != std::string::npos);
    const Outcome issued = ran({"keys", "issue", keys, "--name", "node1", "--role", "node", "--json"});
    CHECK(issued.status == 0);
    CHECK(issued.json()["certificates"][0]["role"] == "node");
    const Outcome shown = ran({"keys", "show", keys, "--json"});
    CHECK(shown.status == 0);
    REQUIRE(shown.json()["certificates"].size() == 2);
    CHECK(shown.json()["certificates"][1]["name"] == "node1");
    const Outcome again = ran({"keys", "issue", keys, "--name", "node1", "--role", "node"});
    CHECK(again.status == 2);
    CHECK(again.complains("exists already"));
    CHECK(ran({"keys", "issue", keys, "--name", "x", "--role", "king"}).complains("--role"));
    CHECK(ran({"keys"}).status == 2);
    CHECK(ran({"keys", "show", "--help"}).status == 0);
  }

  TEST_CASE("bench: one section is one JSON document of numbers") {
    const Folder folder;
    write_room(folder);
    const Outcome outcome = ran({"bench", "kernels", "--scene", folder / "room.toml", "--repeat", "1", "--json"});
    CHECK(outcome.status == 0);
    const nlohmann::json report = outcome.json();
    CHECK(report["repeat"] == 1);
    CHECK_FALSE(report.contains("radiosity"));
    const nlohmann::json& kernels = report["kernels"];
    REQUIRE(kernels.contains("x86-64-v2"));
    for (const nlohmann::json& value : {kernels["scalar"]["pairs_per_s"], kernels["x86-64-v2"]["ratio"],
                                        kernels["bitmap_us"], kernels["visibility16_ns"]}) {
      REQUIRE(value.is_number());
      CHECK(value.get<double>() > 0);
    }
    CHECK(ran({"bench", "kernel"}).complains("is not one of"));
  }

  TEST_CASE("bench: section error writes its plot, keeps the truth, and reads it again") {
    const Folder folder;
    write_room(folder);
    const std::string truth = folder / "truth.csv", plot = folder / "error.svg";
    const std::vector<std::string> small{"bench",  "error",       "--scene",  folder / "room.toml", "--repeat",
                                         "1",      "--elements",  "300..600", "--growth",           "300..4800",
                                         "--json", "--reference", truth};
    std::vector<std::string> first = small;
    for (const std::string& word : {std::string("--points"), std::string("60"), std::string("--paths"), std::string("512"),
                                    std::string("-o"), plot})
      first.push_back(word);
    const Outcome outcome = ran(first);
    REQUIRE(outcome.status == 0);
    const nlohmann::json error = outcome.json()["error"];
    const nlohmann::json& room = error["scenes"]["room"];
    CHECK(error["growth"] == room["growth"]);
    CHECK(room["points"] == 60);
    CHECK(room["truth_paths"].get<int>() >= 256);
    CHECK(room["growth_runs"].size() == 3);
    for (const nlohmann::json& run : room["runs"]) {
      CHECK(run["cpu_s"].get<double>() > 0);
      CHECK(run["error"].get<double>() > 0);
    }
    CHECK(contents(plot).starts_with("<svg "));

    const Outcome again = ran(small);
    REQUIRE(again.status == 0);
    const nlohmann::json same = again.json()["error"]["scenes"]["room"];
    CHECK(same["truth_paths"] == 0);
    // The points have nine digits in the file, so the light there differs by little.
    CHECK(same["truth_error"].get<double>() == doctest::Approx(room["truth_error"].get<double>()).epsilon(1e-6));
    CHECK(same["runs"][0]["error"].get<double>() ==
          doctest::Approx(room["runs"][0]["error"].get<double>()).epsilon(.01));

    CHECK(ran(first).complains("--points: is settled by"));
    CHECK(ran({"bench", "error", "--reference", truth}).complains("belongs to one scene"));
    CHECK(ran({"bench", "kernels", "--points", "60"}).complains("--points: belongs to lichthof bench error"));
    CHECK(ran({"bench", "error", "--elements", "600..300"}).complains("is no range FROM..TO"));
    CHECK(ran({"bench", "error", "-o", "plot.png"}).complains(".svg"));
  }
}
