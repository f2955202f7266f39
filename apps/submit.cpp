/// `lichthof submit`: hands a scene to a cluster, as `render` would take it.
#include <spdlog/spdlog.h>

#include <memory>
#include <string>

#include "actors/link/digest.hpp"
#include "apps/cluster/actions.hpp"
#include "apps/cluster/cluster_options.hpp"
#include "apps/commands.hpp"
#include "apps/common/camera_choice.hpp"
#include "apps/common/files.hpp"
#include "apps/common/log.hpp"
#include "apps/common/picture_options.hpp"
#include "apps/common/progress.hpp"
#include "apps/common/report.hpp"
#include "core/scene/joined_facets.hpp"
#include "io/scene_bytes.hpp"
#include "io/scene_reader.hpp"
#include "io/text.hpp"

namespace lichthof::apps {

namespace {

struct SubmitOptions {
  std::string input, output, title;
  io::ReadOptions read;
  FirstPassOptions first_pass;
  std::optional<std::string> method;
  PictureOptions picture;
  bool wait = false;
  ClusterOptions cluster;
  OutputOptions talk;
};

nlohmann::json json(const Vec3& v) { return {v.x, v.y, v.z}; }

nlohmann::json json(const Camera& camera) {
  return {{"name", io::printable(camera.name)},
          {"eye", json(camera.eye)},
          {"target", json(camera.target)},
          {"up", json(camera.up)},
          {"fov_deg", camera.vertical_fov_deg}};
}

/// What is to be done with the scene; lengths in metres. Numbers that were not given are the controller's to choose.
Expected<nlohmann::json> options_json(const SubmitOptions& options, const Scene& scene) {
  const PictureOptions& picture = options.picture;
  std::uint32_t width = 0, height = 0;
  read_size(picture.size, width, height);
  const Expected<Camera> camera = chosen_camera(picture.camera, TraceScene(std::make_shared<const Scene>(scene)),
                                                scene.file_frame, static_cast<double>(width) / height);
  if (!camera) return camera.error();
  nlohmann::json document = {
      {"method", options.method.value_or("two-pass")}, {"width", width}, {"height", height}, {"camera", json(*camera)}};
  const FirstPassOptions& first = options.first_pass;
  if (first.cells) document["cells"] = *first.cells;
  if (first.eps) document["eps"] = *first.eps;
  if (first.hemicube) document["hemicube"] = *first.hemicube;
  if (first.elements) document["elements"] = *first.elements;
  if (first.patch) document["patch_m"] = *first.patch * scene.file_frame.metres_per_unit;
  if (first.element) document["element_m"] = *first.element * scene.file_frame.metres_per_unit;
  if (picture.samples) document["samples"] = *picture.samples;
  if (picture.gather_rays) document["gather"] = *picture.gather_rays;
  return document;
}

/// Sends the scene, unless the controller has it already. @returns the job's number
Expected<std::uint64_t> submitted(const SubmitOptions& options, const DeskClient& client,
                                  const Interruption& interruption) {
  Expected<io::LoadedScene> loaded = io::read_scene(options.input, options.read);
  if (!loaded) return loaded.error();
  join_facets(loaded->scene);
  for (const std::string& line : loaded->report.text()) spdlog::info("{}", line);
  if (loaded->report.emitters == 0 && has_first_pass(method_named(options.method.value_or("two-pass"))))
    return Error{ErrorCode::bad_input, options.input,
                 "there is no luminaire: give a material an emission (Ke in its MTL file)"};
  const Expected<nlohmann::json> what = options_json(options, loaded->scene);
  if (!what) return what.error();
  const std::string bytes = io::scene_parcel(loaded->scene), hash = actors::sha256_of(bytes);
  const Expected<bool> known = client.has_scene(hash);
  if (!known) return known.error();
  if (!*known) {
    const Interruption::Deferral deferral;
    ProgressLine line(!options.talk.quiet);
    const Status sent = client.upload_scene(hash, bytes, [&](double share) {
      line.show("scene    ", share);
      return !interruption.asked();
    });
    if (!sent) return sent.error();
  }
  const std::string title = options.title.empty() ? options.input : options.title;
  const Expected<nlohmann::json> answer =
      client.post("/v1/jobs", {{"scene", hash}, {"title", io::printable(title).substr(0, 200)}, {"options", *what}});
  if (!answer) return answer.error();
  if (!answer->is_object() || !answer->contains("id") || !(*answer)["id"].is_number_unsigned())
    return Error{ErrorCode::failed, client.address().host, "answers without the number of the job"};
  return (*answer)["id"].get<std::uint64_t>();
}

Status submit(const SubmitOptions& options, const DeskClient& client, const Interruption& interruption) {
  log_as_asked(options.talk);
  const PictureOptions& picture = options.picture;
  if (Status fits = picture_fits(picture, method_named(options.method.value_or("two-pass"))); !fits) return fits;
  if (!options.output.empty())
    if (Status ready = result_file_ready(options.output); !ready) return ready;
  if (!picture.solution.empty())
    if (Status ready = output_ready(picture.solution, {}, {options.input, options.output}); !ready) return ready;
  const Expected<std::uint64_t> id = submitted(options, client, interruption);
  if (!id) return id.error();
  nlohmann::json report = {{"command", "submit"}, {"version", LICHTHOF_VERSION}, {"input", options.input}, {"id", *id}};
  std::vector<std::string> lines;
  if (!options.wait && options.output.empty() && picture.solution.empty())
    return print(options.talk, report, {std::to_string(*id)});

  const Expected<nlohmann::json> last = followed(client, *id, options.talk.quiet, interruption);
  if (!last) return last.error();
  report["job"] = *last;
  lines.push_back("job " + std::to_string(*id) + " is done");
  if (!picture.solution.empty()) {
    const Expected<std::uint64_t> bytes = fetched(client, *id, picture.solution, "solution.lht");
    if (!bytes) return bytes.error();
    report["solution"] = picture.solution;
  }
  if (!options.output.empty()) {
    const Expected<std::uint64_t> bytes = fetched_result(client, *id, options.output, picture.exposure_ev);
    if (!bytes) return bytes.error();
    report["output"] = options.output, report["bytes"] = *bytes;
    lines = {options.output + ": " + picture.size + " pixels, job " + std::to_string(*id)};
  }
  return print(options.talk, report, lines);
}

void add_options(CLI::App& command, SubmitOptions& options) {
  command.add_option("SCENE", options.input, "a scene (.obj, .toml)")->required()->option_text(" ");
  command
      .add_option("-o,--output", options.output,
                  "wait, and fetch the picture (.exr, .hdr, .png) or the solution (.lht)")
      ->option_text("FILE");
  command.add_flag("--wait", options.wait, "wait for the job's end; Ctrl-C stops waiting, the job runs on");
  command.add_option("--title", options.title, "what lists of jobs show (default: SCENE)")->option_text("TEXT");
  add_picture_options(command, options.picture);
  add_method_option(command, options.method, {"two-pass", "radiosity", "raytrace", "hemicube", "reference"});
  add_scene_options(command, options.read);
  add_first_pass_options(command, options.first_pass);
}

}  // namespace

void add_submit(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<SubmitOptions>();
  CLI::App& command = *program.add_subcommand("submit", "hand a scene to a cluster");
  add_options(command, *options);
  add_cluster_options(command, options->cluster);
  add_output_options(command, options->talk);
  command.footer(
      "Prints the number of the job. The scene is read and checked here, and sent only when the controller lacks it.\n"
      "Options mean what they mean to render; but without --cells there is a cell for each node.\n"
      "\nExamples:\n"
      "  lichthof submit room.obj --cluster lab7:7410\n"
      "  lichthof submit scenes/two_rooms.toml -o dark.png --camera dark --cells 2x1\n"
      "  lichthof jobs watch $(lichthof submit room.obj --title \"the room\" --size 1280x720)");
  command.callback([options, &chosen] {
    chosen = [options](Interruption& interruption) -> Status {
      const Expected<DeskClient> client = desk_client(options->cluster);
      if (!client) return client.error();
      return submit(*options, *client, interruption);
    };
  });
}

Status submit_line(const std::vector<std::string>& words, const DeskClient& client, const OutputOptions& talk,
                   Interruption& interruption) {
  SubmitOptions options;
  options.talk = talk;
  CLI::App line{"", "submit"};
  add_options(line, options);
  try {
    line.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::CallForHelp&) {
    return print(talk, {{"help", line.help()}}, {line.help()});
  } catch (const CLI::ParseError& error) {
    return Error{ErrorCode::bad_input, "submit", error.what()};
  }
  return submit(options, client, interruption);
}

}  // namespace lichthof::apps
