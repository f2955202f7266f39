/// What is handed in to a lab is what is rendered here; and what the lab says of itself meanwhile.
#include <doctest/doctest.h>

#include <set>

#include "io/image_writer.hpp"
#include "tests/system/small_lab.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

std::vector<float> pixels(const std::string& path) {
  const Expected<io::Image> image = io::read_image(path);
  REQUIRE(image);
  return image->rgb;
}

}  // namespace

TEST_SUITE("submit") {
  TEST_CASE("submit: with the options of render comes the picture of render") {
    SmallLab lab;
    const Folder& folder = lab.folder;
    write_room(folder);
    const std::vector<std::string> picture{"--camera", "door",     "--size", "48x36",      "--samples",
                                           "2",        "--gather", "24",     "--exposure", "-1.5"};
    const auto with = [&](std::vector<std::string> words) {
      words.insert(words.end(), picture.begin(), picture.end());
      return words;
    };
    // In one cell the order of the shots is the same everywhere, and so is the light.
    const std::vector<std::string> scene{folder / "room.toml", "--cells", "1", "--elements", "2500", "--eps", "1e-3"};
    for (const std::string ending : {".png", ".exr", ".hdr"}) {
      INFO(ending);
      std::vector<std::string> far{"submit"}, here{"render"};
      far.insert(far.end(), scene.begin(), scene.end()), here.insert(here.end(), scene.begin(), scene.end());
      far.insert(far.end(), {"-o", folder / ("far" + ending), "--solution", folder / "far.lht"});
      here.insert(here.end(), {"-o", folder / ("here" + ending), "--quiet"});
      const Outcome submitted = lab.asked(with(far));
      INFO(submitted.err);
      REQUIRE(submitted.status == 0);
      REQUIRE(ran(with(here)).status == 0);
      CHECK(pixels(folder / ("far" + ending)) == pixels(folder / ("here" + ending)));
      // The light that came with it gives the same picture again.
      REQUIRE(ran(with({"render", folder / "far.lht", "-o", folder / ("again" + ending), "--quiet"})).status == 0);
      CHECK(pixels(folder / ("far" + ending)) == pixels(folder / ("again" + ending)));
    }
    // The options are not idle: without them it is another picture.
    REQUIRE(ran({"render", folder / "far.lht", "-o", folder / "plain.png", "--camera", "door", "--size", "48x36",
                 "--samples", "2", "--exposure", "-1.5", "--quiet"})
                .status == 0);
    CHECK(pixels(folder / "plain.png") != pixels(folder / "far.png"));
    CHECK(lab.asked({"jobs", "result", "1", "-o", folder / "later.png", "--exposure", "-1.5"}).status == 0);
    CHECK(pixels(folder / "later.png") == pixels(folder / "far.png"));
  }

  TEST_CASE("submit: what a method has no use for is refused as render refuses it") {
    SmallLab lab;
    write_room(lab.folder);
    const std::string room = lab.folder / "room.toml";
    for (const std::vector<std::string>& options : {std::vector<std::string>{"--method", "radiosity", "--gather", "8"},
                                                    {"--method", "raytrace", "--solution", lab.folder / "x.lht"}}) {
      std::vector<std::string> words{"submit", room};
      words.insert(words.end(), options.begin(), options.end());
      const Outcome refused = lab.asked(words);
      CHECK(refused.status == 2);
      CHECK(refused.complains(options[2]));
    }
  }

  TEST_CASE("top: cells and workers show what they did, hold and send") {
    SmallLab lab;
    lab.start_node("bert", free_port());
    REQUIRE(until([&] { return lab.node_count() == 2; }));
    write_room(lab.folder);
    const Outcome submitted = lab.asked({"submit", lab.folder / "room.toml", "--cells", "2x1", "--elements", "20000",
                                         "--eps", "1e-9", "--size", "320x240", "--samples", "64"});
    INFO(submitted.err);
    REQUIRE(submitted.status == 0);
    const std::string id = std::to_string(submitted.json()["id"].get<int>());
    // Cells wait for each other's light, so each is seen at work at a time of its own; what it overshot is unshot less than 0.
    std::set<std::string> cells, workers;
    const auto job = [&] { return lab.asked({"jobs", id}).json()["job"]; };
    const auto is_over = [&] { return job()["state"] == "done"; };
    REQUIRE(until([&] {
      const nlohmann::json load = lab.asked({"top"}).json();
      for (const nlohmann::json& actor : load["actors"]) {
        const auto figure = [&](const char* key) { return actor[key].get<double>(); };
        if (figure("busy_share") <= 0 || figure("rays_per_s") <= 0 || figure("memory_bytes") < 1000) continue;
        if (figure("bytes_in") <= 0 || figure("bytes_out") <= 0) continue;
        // The elements alone: some 10 000 in each cell, two sums of light and what was shot in three channels of 4 bytes.
        const std::string name = actor["actor"];
        if (actor["kind"] == "cell" && figure("shots_per_s") > 0 && figure("unshot_w") != 0 &&
            figure("memory_bytes") > 10'000 * 60 && (actor["state"] == "shooting" || actor["state"] == "idle"))
          cells.insert(name);
        if (actor["kind"] == "worker") workers.insert(name);
      }
      return (cells.size() == 2 && workers.size() == 2) || is_over();
    }));
    CHECK(cells.size() == 2);
    CHECK(workers.size() == 2);
    REQUIRE(until(is_over));
    const nlohmann::json done = job();
    CHECK(done["messages"].get<double>() > 0);
    CHECK(done["bytes_per_shot"].get<double>() * done["shots"].get<double>() ==
          doctest::Approx(done["bytes_sent"].get<double>()));
    CHECK(done["bytes_per_message"].get<double>() * done["messages"].get<double>() ==
          doctest::Approx(done["bytes_sent"].get<double>()));
    CHECK(lab.asked({"jobs", "log", id}).out.find("bytes per shot") != std::string::npos);
  }
}
