/// `lichthof probe`: irradiance or illuminance at sensor points.
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "apps/accuracy.hpp"
#include "apps/commands.hpp"
#include "apps/common/files.hpp"
#include "apps/common/log.hpp"
#include "apps/pipeline.hpp"
#include "io/points_file.hpp"

namespace lichthof::apps {

namespace {

constexpr std::uint32_t default_samples = 1024;

struct ProbeCommand {
  RunOptions run;
  std::string points;
  bool photometric = false;
  std::optional<std::uint32_t> gather_rays, samples;
  ErrorWish accuracy;
};

std::vector<SensorPoint> sensors_of(const io::SensorPoints& points) {
  std::vector<SensorPoint> sensors(points.positions.size());
  for (std::size_t i = 0; i < sensors.size(); ++i) sensors[i] = {points.positions[i], points.normals[i]};
  return sensors;
}

/// RMS of the standard errors over RMS of the values, both over all points and channels.
double relative_error(const std::vector<Estimate>& estimates) {
  double error = 0, value = 0;
  for (const Estimate& estimate : estimates) {
    error += glm::dot(estimate.standard_error, estimate.standard_error);
    value += glm::dot(estimate.mean, estimate.mean);
  }
  return value > 0 ? std::sqrt(error / value) : 0;
}

std::vector<Rgb> measured(Run& run, const std::vector<SensorPoint>& sensors, const ProbeCommand& options,
                          const ErrorKnobs& knobs) {
  if (run.method() != Method::reference) return run.irradiance(sensors, knobs);
  const std::vector<Estimate> estimates = run.reference_irradiance(sensors, options.samples.value_or(default_samples));
  std::vector<Rgb> irradiance;
  for (const Estimate& estimate : estimates) irradiance.push_back(estimate.mean);
  run.record().more["standard_error"] = relative_error(estimates);
  return irradiance;
}

Status check_options(const ProbeCommand& options, Method method) {
  if (options.samples && method != Method::reference)
    return Error{ErrorCode::bad_input, "--samples", "belongs to --method reference; the others take --gather"};
  if (options.gather_rays && (method == Method::reference || method == Method::radiosity))
    return Error{ErrorCode::bad_input, "--gather", std::string("method ") + name_of(method) + " gathers nothing"};
  return Done{};
}

Status probe(const ProbeCommand& options, const Interruption& interruption) {
  log_as_asked(options.run.talk);
  if (Status ready = output_ready(options.run.output, {}, {options.run.input, options.points}); !ready) return ready;
  Run run("probe", options.run, Method::two_pass, interruption);
  if (Status checked = check_options(options, run.method()); !checked) return checked;
  if (Status fits = wish_fits(options.accuracy, run); !fits) return fits;
  if (Status loaded = run.load(false); !loaded) return loaded;
  const Expected<io::SensorPoints> points = io::read_points(options.points, run.frame());
  if (!points) return points.error();

  const std::vector<SensorPoint> sensors = sensors_of(*points);
  std::optional<std::vector<Rgb>> irradiance;
  if (!options.accuracy.is_set() && !options.gather_rays && has_first_pass(run.method()))
    irradiance = run.irradiance_by_paths(sensors);
  ErrorKnobs knobs;
  if (!irradiance && has_first_pass(run.method())) {
    const Question question{Reading::at_sensors,
                            [&sensors](const LitScene& scene, std::uint32_t most, std::uint64_t seed) {
                              return sensor_check_points(scene, sensors, most, seed);
                            },
                            options.gather_rays};
    const Expected<ErrorKnobs> reached = reach(run, options.accuracy, question, interruption);
    if (!reached) return reached.error();
    if (interruption.asked()) return Error{ErrorCode::interrupted, "", "interrupted"};
    knobs = *reached;
  }
  if (!irradiance) irradiance = measured(run, sensors, options, knobs);
  const Interruption::Deferral deferral;
  const Status written = options.photometric ? io::write_illuminance(options.run.output, *points, *irradiance)
                                             : io::write_irradiance(options.run.output, *points, *irradiance);
  if (!written) return written;
  RunRecord& record = run.record();
  record.more["points"] = points->rows.size();
  if (Status printed = print(options.run.talk, json(record),
               summary(record, options.run.output + ": " + (options.photometric ? "lux" : "W/m²") + " at " +
                                   grouped(points->rows.size()) + " points, " + record.method));
      !printed)
    return printed;
  return strictly(options.accuracy, run);
}

}  // namespace

void add_probe(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<ProbeCommand>();
  CLI::App& command = *program.add_subcommand("probe", "compute irradiance at sensor points");
  command.add_option("SCENE", options->run.input, "a scene (.obj, .toml) or a solution")->required()->option_text(" ");
  command
      .add_option("--points", options->points,
                  "CSV with columns x,y,z,nx,ny,nz in scene units, on surfaces or in free air")
      ->required()
      ->option_text("P.csv");
  command.add_option("-o,--output", options->run.output, "the same rows with Er,Eg,Eb appended (W/m²)")
      ->required()
      ->option_text("OUT.csv");
  command.add_flag("--photometric", options->photometric, "append lux instead: 179 lm/W on the CIE Y");
  add_method_option(command, options->run.method, {"two-pass", "radiosity", "hemicube", "reference"});
  command
      .add_option("--gather", options->gather_rays,
                  "rays of the final gather at each point; 0 interpolates the solution (default: as many as "
                  "the light there takes)")
      ->check(number_within(0, 65536))
      ->option_text("N");
  command.add_option("--samples", options->samples, "paths per point, method reference (default 1024)")
      ->check(number_within(2, 1e9))
      ->option_text("N");
  add_error_options(command, options->accuracy, "the irradiance over the points");
  add_threads_option(command, options->run.threads);
  add_scene_options(command, options->run.read);
  add_first_pass_options(command, options->run.first_pass);
  add_output_options(command, options->run.talk);
  command.footer(
      "Light is counted on the side the normal points to. A point on a surface is not shadowed by it.\n"
      "Where few points cost less by paths from them, no first pass is made, unless a method or an option of it is "
      "given.\n"
      "Methods: two-pass computes direct light at the point and gathers the rest from the first pass; radiosity reads "
      "the first\n"
      "pass at the point; hemicube finds visibility by the item buffer; reference is a path tracer, whose standard "
      "error is in\n"
      "the --json report.\n"
      "\nExamples:\n"
      "  lichthof probe room.obj --points desks.csv -o desks_lux.csv --photometric\n"
      "  lichthof probe room.lht --points desks.csv -o desks_irradiance.csv --gather 1024\n"
      "  lichthof probe room.obj --points desks.csv -o truth.csv --method reference --samples 16384 --json");
  command.callback(
      [options, &chosen] { chosen = [options](Interruption& interruption) { return probe(*options, interruption); }; });
}

}  // namespace lichthof::apps
