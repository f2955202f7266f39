/// `lichthof render`: the main job, both passes and a picture.
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "apps/accuracy.hpp"
#include "apps/commands.hpp"
#include "apps/common/files.hpp"
#include "apps/common/log.hpp"
#include "apps/pipeline.hpp"
#include "io/image_writer.hpp"
#include "io/text.hpp"

namespace lichthof::apps {

namespace {

struct RenderOptions {
  RunOptions run;
  PictureOptions picture;
  std::string balance = "adaptive";
  ErrorWish accuracy;
};

/// The film's columns as rows.
std::vector<float> rows_of(const Image& image) {
  std::vector<float> rows;
  rows.reserve(std::size_t{3} * image.width() * image.height());
  for (std::uint32_t row = 0; row < image.height(); ++row)
    for (std::uint32_t column = 0; column < image.width(); ++column) {
      const Rgbf& pixel = image.at(column, row);
      rows.insert(rows.end(), {pixel.x, pixel.y, pixel.z});
    }
  return rows;
}

/// What is left of an interrupted run, in one line.
Error interrupted(const std::string& kept) {
  const std::string message = kept.empty() ? "interrupted" : "interrupted; the solution so far is kept in " + kept;
  return {ErrorCode::interrupted, "", message};
}

Status render(const RenderOptions& options, const Interruption& interruption) {
  log_as_asked(options.run.talk);
  // What could spoil the end of a long run is looked at first.
  if (Status ready = output_ready(options.run.output, {".exr", ".hdr", ".png"}, {options.run.input}); !ready)
    return ready;
  if (!options.picture.solution.empty())
    if (Status ready = output_ready(options.picture.solution, {}, {options.run.input, options.run.output}); !ready)
      return ready;
  Run run("render", options.run, Method::two_pass, interruption);
  if (Status fits = picture_fits(options.picture, run.method()); !fits) return fits;
  if (Status fits = wish_fits(options.accuracy, run); !fits) return fits;
  if (Status loaded = run.load(false); !loaded) return loaded;
  const Expected<Camera> camera = run.camera(options.picture);
  if (!camera) return camera.error();

  PictureOptions wanted = options.picture;
  if (has_first_pass(run.method())) {
    const PinholeCamera film(*camera, wanted.width, wanted.height);
    const double exposure = wanted.exposure_ev ? std::exp2(*wanted.exposure_ev) : 0;
    const Question question{Reading::in_picture,
                            [&film, exposure](const LitScene& scene, std::uint32_t most, std::uint64_t seed) {
                              return picture_check_points(scene, film, exposure, most, seed);
                            },
                            wanted.gather_rays};
    const Expected<ErrorKnobs> reached = reach(run, options.accuracy, question, interruption);
    if (!reached) return reached.error();
    wanted.gather_rays = reached->gather_rays;
  }
  if (!wanted.solution.empty())
    if (Status kept = run.keep(wanted.solution); !kept) return kept;
  if (interruption.asked()) return interrupted(wanted.solution);
  const Expected<Image> picture = run.picture(*camera, wanted);
  if (!picture) return interrupted(options.picture.solution);

  const Interruption::Deferral deferral;
  const std::vector<float> rows = rows_of(*picture);
  const io::ImageView view{picture->width(), picture->height(), rows.data()};
  if (Status written = io::write_image(options.run.output, view, {options.picture.exposure_ev}); !written)
    return written;
  RunRecord& record = run.record();
  record.more["width"] = picture->width();
  record.more["height"] = picture->height();
  record.more["camera"] = camera->name;
  if (Status printed = print(options.run.talk, json(record),
               summary(record, options.run.output + ": " + options.picture.size + " pixels, " + record.method +
                                   ", camera " + camera->name));
      !printed)
    return printed;
  return strictly(options.accuracy, run);
}

}  // namespace

void add_render(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App& command = *program.add_subcommand("render", "make a picture of a scene or a solution");
  command.add_option("SCENE", options->run.input, "a scene (.obj, .toml) or a solution")->required()->option_text(" ");
  command
      .add_option("-o,--output", options->run.output, "the picture: .exr or .hdr (linear radiance), .png (tone mapped)")
      ->required()
      ->option_text("IMAGE");
  add_picture_options(command, options->picture);
  add_method_option(command, options->run.method, {"two-pass", "radiosity", "raytrace", "hemicube", "reference"});
  command
      .add_option("--balance", options->balance,
                  "how columns are handed to workers: adaptive or boxes; the picture is the same")
      ->check(one_of({"adaptive", "boxes"}))
      ->option_text("NAME");
  add_error_options(command, options->accuracy, "what surfaces that don't emit send to the eye");
  add_threads_option(command, options->run.threads);
  add_scene_options(command, options->run.read);
  add_first_pass_options(command, options->run.first_pass);
  add_output_options(command, options->run.talk);
  command.footer(
      "Methods: two-pass traces direct light by rays and takes indirect light from the first pass; radiosity shows the "
      "first pass\n"
      "as it is; raytrace replaces it by a constant; hemicube finds visibility by the item buffer; reference is a path "
      "tracer.\n"
      "\nExamples:\n"
      "  lichthof render room.obj -o room.png\n"
      "  lichthof render room.obj -o room.exr --camera \"1,2,1.7; 5,5,1; 0,0,1; 60\" --size 1280x720\n"
      "  lichthof render scenes/two_rooms.toml -o dark.png --camera dark --cells 2x1 --solution rooms.lht\n"
      "  lichthof render rooms.lht -o lit.png --camera lit --exposure 1");
  command.callback([options, &chosen] {
    read_size(options->picture.size, options->picture.width, options->picture.height);
    options->picture.scheduling = options->balance == "boxes" ? Scheduling::boxes : Scheduling::adaptive;
    chosen = [options](Interruption& interruption) { return render(*options, interruption); };
  });
}

}  // namespace lichthof::apps
