#include "apps/pipeline.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "actors/local_run.hpp"
#include "actors/meter.hpp"
#include "apps/cluster/memory_room.hpp"
#include "apps/common/camera_choice.hpp"
#include "apps/common/ledger_fault.hpp"
#include "apps/common/mesh_choice.hpp"
#include "apps/common/progress.hpp"
#include "core/base/random.hpp"
#include "core/light/refinement.hpp"
#include "core/light/stopping.hpp"
#include "core/scene/joined_facets.hpp"
#include "core/tracing/picture_source.hpp"
#include "io/solution_file.hpp"

namespace lichthof::apps {

namespace {

/// Relative standard error at which a point has rays enough, where nothing else was asked for: at this many points. Few points can
/// have more, many get by with less.
constexpr double gather_error = 0.02, usual_points = 500, least_gather_error = 0.012, most_gather_error = 0.03;
// Sensor points are written with 6 or 7 digits: this far from a surface counts as on it, in sizes of the scene.
constexpr double on_surface = 1e-5;
constexpr std::uint32_t default_reference_samples = 64;

double emitted_power_w(const Scene& scene) {
  double power = 0;
  for (const Surface& surface : scene.surfaces)
    power += std::numbers::pi * surface.area * sum_channels(scene.material_of(surface).radiance);
  return power;
}

/// What the first pass itself knows, at the points that lie on its elements.
void read_first_pass(const LitScene& scene, std::span<const SensorPoint> points, std::vector<Rgb>& irradiance) {
  const double tolerance = std::max(on_surface * scene.trace().size(), 4 * scene.trace().offset());
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const auto at = scene.trace().surface_below(points[i].point, points[i].normal, tolerance);
        at && scene.has_elements(*at))
      irradiance[i] = scene.total_irradiance(*at);
}

/// @error failed, naming element, patch and face
Status is_finite(const Solution& solution) {
  const Mesh& mesh = *solution.mesh;
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
    const Patch& patch = mesh.patches[p];
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      if (all_finite(Vec3{solution.irradiance[e]}) && all_finite(Vec3{solution.shot[e]})) continue;
      const std::uint32_t face = solution.scene->surfaces[patch.surface.value].source_face;
      return Error{ErrorCode::failed, "",
                   "the light of element " + std::to_string(e) + " in patch " + std::to_string(p) + ", of face " +
                       std::to_string(face) +
                       " of the scene, grew beyond all numbers: do faces lie in each other there?"};
    }
  }
  return Done{};
}

/// Light that is still to be distributed, whatever its sign, relative to all that has arrived. Shots go ahead of the light that
/// is expected, so net sums are small long before each place has its own.
double unshot_share(const Solution& solution) {
  double unshot = 0, all = 0;
  for (const Patch& patch : solution.mesh->patches)
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const Rgb arrived{solution.irradiance[e]};
      const double area = solution.mesh->elements[e].area;
      unshot += area * sum_channels(glm::abs(patch.exitance + patch.reflectance * arrived - Rgb{solution.shot[e]}));
      all += area * sum_channels(arrived);
    }
  return all > 0 ? unshot / all : 0;
}

/// Relative RMS noise of a reading, as another one shows it whose gather has other rays, and whose direct light is the mean of
/// the same rays and as many others.
ReadingNoise reading_noise(const CheckPoints& places, const std::vector<PointLight>& one,
                           const std::vector<PointLight>& other, bool is_gathered) {
  double direct = 0, indirect = 0, all = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    const CheckPoint& point = places.points[i];
    const Rgb d = point.share * (one[i].direct - other[i].direct),
              r = point.share * (one[i].indirect - other[i].indirect), total = point.share * one[i].total();
    direct += 2 * point.weight * glm::dot(d, d), indirect += 0.5 * point.weight * glm::dot(r, r);
    all += point.weight * glm::dot(total, total);
  }
  if (!(all > 0)) return {};
  return {std::sqrt(direct / all), is_gathered ? std::optional(std::sqrt(indirect / all)) : std::nullopt};
}

ProbeOptions probe_options(const ErrorKnobs& knobs, std::size_t points) {
  ProbeOptions options = lichthof::probe_options(knobs.gather_rays, knobs.direct_rays);
  if (knobs.counts_gather) return options;
  options.gather_rays = GatherOptions{}.least;
  const double share = std::pow(static_cast<double>(points) / usual_points, 0.25);
  options.gather_error = std::clamp(share * gather_error, least_gather_error, most_gather_error);
  return options;
}

/// What each actor of a pass has done, as `lichthof top` would show it of a lab.
void add_actors(const actors::Meters& meters, RunRecord& record) {
  for (const auto& meter : meters.all())
    record.more["actors"].push_back({{"actor", meter->name},
                                     {"busy_s", 1e-9 * static_cast<double>(meter->busy_ns_now())},
                                     {"messages", meter->arrived.load()},
                                     {"steps", meter->steps.load()},
                                     {"rays", meter->rays.load()},
                                     {"bytes_out", meter->bytes.load()}});
}

}  // namespace

Run::Run(const char* command, const RunOptions& options, Method default_method, const Interruption& interruption)
    : options_(options), method_(options.method ? method_named(*options.method) : default_method),
      interruption_(interruption), parallel_(std::make_shared<Parallel>(threads_to_use(options.threads))) {
  record_.command = command;
  record_.input = options.input;
  record_.output = options.output;
  record_.method = name_of(method_);
  record_.threads = parallel_->threads();
}

// ---- Load -------------------------------------------------------------------------------------------------------------

Status Run::load(bool resumes) {
  const Stopwatch watch;
  const Status loaded = io::is_solution_file(options_.input) ? load_solution(resumes) : load_scene();
  if (!loaded) return loaded;
  record_.emitted_w = emitted_power_w(*scene_);
  record_.seconds.load = watch.seconds();
  return expect_light();
}

Status Run::load_scene() {
  Expected<io::LoadedScene> loaded = io::read_scene(options_.input, options_.read);
  if (!loaded) return loaded.error();
  for (const std::string& line : loaded->report.text()) {
    constexpr std::string_view warning = "warning: ";
    if (line.starts_with(warning))
      spdlog::warn("{}", line.substr(warning.size()));
    else
      spdlog::info("{}", line);
  }
  record_.import = std::move(loaded->report);
  if (const std::size_t joined = join_facets(loaded->scene); joined > 0)
    spdlog::info("facets of luminaires joined to larger ones: {} fewer", joined);
  scene_ = std::make_shared<const Scene>(std::move(loaded->scene));
  frame_ = scene_->file_frame;
  return Done{};
}

Status Run::load_solution(bool resumes) {
  const auto refused = [this](const std::string& option, const std::string& why) {
    return Error{ErrorCode::bad_input, option, options_.input + " " + why};
  };
  const FirstPassOptions& first = options_.first_pass;
  if (!resumes && !first.given().empty())
    return refused(first.given(), "is solved already; continue it with: lichthof solve " + options_.input);
  if (!first.mesh_given().empty())
    return refused(first.mesh_given(), "has its mesh already; solve the scene anew for another one");
  Expected<Solution> solution = io::read_solution(options_.input);
  if (!solution) return solution.error();
  const bool was_hemicube = solution->options.method == TransferMethod::hemicube;
  if (method_ == Method::hemicube && !was_hemicube) return refused("--method hemicube", "was solved with shadow rays");
  if (was_hemicube && resumes) method_ = Method::hemicube, record_.method = name_of(method_);
  Expected<FileFrame> frame = io::frame_with(solution->scene->file_frame, options_.read);
  if (!frame) return frame.error();
  frame_ = *frame;
  scene_ = solution->scene;
  mesh_ = solution->mesh;
  solution_ = std::move(*solution);
  if (!solution_->converged && !resumes)
    spdlog::warn("{}: is not solved to its end; continue it with: lichthof solve {} -o {}", options_.input,
                 options_.input, options_.input);
  return Done{};
}

Status Run::expect_light() const {
  if (record_.emitted_w > 0) return Done{};
  const std::string message =
      "there is no luminaire: give a material an emission (Ke in its MTL file: radiance in W/(m² sr); emission in a "
      "scene file)";
  if (has_first_pass(method_)) return Error{ErrorCode::bad_input, options_.input, message};
  spdlog::warn("{}: {}", options_.input, message);
  return Done{};
}

// ---- Mesh -------------------------------------------------------------------------------------------------------------

MeshOptions Run::mesh_options() const {
  const FirstPassOptions& first = options_.first_pass;
  MeshOptions wanted;
  wanted.patch_size = first.patch.value_or(0) * frame_.metres_per_unit;
  wanted.element_size = first.element.value_or(0) * frame_.metres_per_unit;
  if (first.elements) wanted.target_elements = *first.elements;
  if (first.mesh_given().empty() && scene_->patch_size) wanted.patch_size = *scene_->patch_size;
  if (first.mesh_given().empty() && scene_->element_size) wanted.element_size = *scene_->element_size;
  return wanted;
}

/// Meshes are made anew as an error that was asked for wants them; what is wrong with the scene is said the first time.
void Run::warn_once(const std::string& line) {
  if (!record_.import) return;
  std::vector<std::string>& notes = record_.import->notes;
  const std::string named = options_.input + ": " + line;
  if (std::find(notes.begin(), notes.end(), named) != notes.end()) return;
  spdlog::warn("{}", named);
  notes.push_back(named);
}

Status Run::mesh() {
  const MeshOptions wanted = mesh_options();
  Expected<ChosenMesh> mesh = mesh_for(*scene_, wanted, *parallel_, memory_room().free_bytes);
  if (!mesh) {
    Error error = mesh.error();
    if (error.where.empty()) error.where = options_.input;
    return error;
  }
  mesh_ = std::move(mesh->mesh);
  for (const std::string& line : mesh->warnings) warn_once(line);
  spdlog::info("mesh: patches of {:.4g} m, elements of {:.4g} m", mesh_->options.patch_size,
               mesh_->options.element_size);
  return Done{};
}

Status Run::divide() {
  CellsWanted wanted;
  if (options_.first_pass.cells)
    wanted = *cells_wanted(*options_.first_pass.cells);  // checked when the command line was read
  else if (solution_)
    wanted.along = solution_->options.cells;
  Expected<CellGrid> grid = partition(*mesh_, bounds(*scene_), wanted);
  if (!grid) return grid.error();
  grid_ = std::make_shared<const CellGrid>(std::move(*grid));
  return Done{};
}

// ---- Radiosity --------------------------------------------------------------------------------------------------------

SolveOptions Run::solve_options() const {
  const FirstPassOptions& first = options_.first_pass;
  SolveOptions options;
  if (solution_)
    options = solution_->options;
  else
    options.mesh = mesh_options(), options.hemicube_resolution = default_hemicube;
  if (first.hemicube) options.hemicube_resolution = *first.hemicube;
  if (!solution_ && method_ == Method::hemicube) options.method = TransferMethod::hemicube;
  if (first.eps || !solution_) options.eps = first.eps ? *first.eps : default_eps(*scene_, *mesh_, options.method);
  options.cells = grid_->size();
  return options;
}

Status Run::solve() {
  const Stopwatch mesh_watch;
  if (!mesh_)
    if (Status meshed = mesh(); !meshed) return meshed;
  if (Status divided = divide(); !divided) return divided;
  record_.seconds.mesh += mesh_watch.seconds();

  const Stopwatch watch;
  ProgressLine line(!options_.talk.quiet, before_);
  actors::SolveRun run;
  run.scene = scene_;
  run.mesh = mesh_;
  run.grid = grid_;
  run.options = solve_options();
  run.parallel = parallel_;
  run.resume = solution_ ? &*solution_ : nullptr;
  run.stop = &interruption_.asked();
  run.progress = [&line](const RadiosityProgress& progress) { line.show(progress); };
  run.meters = std::make_shared<actors::Meters>();
  const Interruption::Deferral deferral;
  spdlog::info("first pass: {} elements, {} cells, {} threads", mesh_->elements.size(), grid_->cell_count(),
               parallel_->threads());
  Solution solution = actors::solve(run);
  if (Status finite = is_finite(solution); !finite) return finite;
  solution_ = std::move(solution);
  add_actors(*run.meters, record_);
  record_.seconds.radiosity += watch.seconds();
  return Done{};
}

void Run::choose(std::optional<std::uint32_t> elements, double eps) {
  options_.first_pass.eps = eps;
  if (!elements) return;
  options_.first_pass.elements = elements;
  mesh_.reset(), grid_.reset(), solution_.reset();
}

bool Run::refine(double keep) {
  const Stopwatch watch;
  if (!mesh_ && !this->mesh()) return false;  // solve() will say why
  std::shared_ptr<const Mesh> mesh = refined_mesh(scene_, mesh_, keep, *parallel_);
  record_.seconds.mesh += watch.seconds();
  if (mesh == mesh_) return false;
  mesh_ = std::move(mesh);
  grid_.reset(), solution_.reset();
  return true;
}

void Run::warn_of_ledger() const {
  if (!solution_) return;
  if (const std::string why = ledger_fault(*solution_); !why.empty()) spdlog::warn("{}: {}", options_.input, why);
}

Status Run::keep(const std::string& path) {
  const Interruption::Deferral deferral;
  if (Status written = io::write_solution(path, *solution_); !written) return written;
  record_.kept_solution = path;
  return Done{};
}

// ---- Rays -------------------------------------------------------------------------------------------------------------

LitScenePtr Run::lit_scene() const {
  return solution_ ? std::make_shared<const LitScene>(*solution_) : std::make_shared<const LitScene>(scene_);
}

Expected<Camera> Run::camera(const PictureOptions& wanted) const {
  return chosen_camera(wanted.camera, TraceScene(scene_), frame_, static_cast<double>(wanted.width) / wanted.height);
}

std::unique_ptr<const ColumnSource> Run::column_source(const Camera& camera, const PictureOptions& wanted) const {
  PictureWish wish;
  wish.path_tracing = method_ == Method::reference;
  wish.method = method_ == Method::raytrace    ? TracingMethod::raytrace
                : method_ == Method::radiosity ? TracingMethod::radiosity
                                               : TracingMethod::two_pass;
  wish.camera = camera;
  wish.width = wanted.width, wish.height = wanted.height;
  wish.samples = wanted.samples.value_or(wish.path_tracing ? default_reference_samples : TracingOptions{}.samples);
  wish.gather_rays = wanted.gather_rays.value_or(0);
  wish.stop = &interruption_.asked();
  return picture_source(lit_scene(), wish);
}

Expected<Image> Run::picture(const Camera& camera, const PictureOptions& wanted) {
  const Stopwatch watch;
  ProgressLine line(!options_.talk.quiet, before_);
  actors::TraceRun run;
  run.source = column_source(camera, wanted);
  run.workers = parallel_->threads();
  run.scheduling = wanted.scheduling;
  run.stop = &interruption_.asked();
  run.progress = [&line](double share) { line.show(share); };
  run.meters = std::make_shared<actors::Meters>();
  const Interruption::Deferral deferral;
  spdlog::info("second pass: {} x {} pixels, {} threads", wanted.width, wanted.height, run.workers);
  actors::TraceResult result = actors::trace(run);
  record_.traced_rays += result.rays;
  add_actors(*run.meters, record_);
  record_.seconds.rays = watch.seconds();
  record_.more["jobs"] = result.jobs;
  record_.more["idle_seconds"] = result.idle_seconds;
  if (!result.complete || interruption_.asked())
    return Error{ErrorCode::interrupted, "", "interrupted before the picture was complete"};
  line.show(1.0);
  return std::move(result.image);
}

std::vector<Rgb> Run::irradiance(std::span<const SensorPoint> points, const ErrorKnobs& knobs) {
  const Stopwatch watch;
  const std::shared_ptr<const LitScene> scene = lit_scene();
  const ProbeOptions options = probe_options(knobs, points.size());
  std::vector<Rgb> irradiance = sensor_irradiance(scene, points, options, *parallel_, record_.traced_rays);
  if (method_ == Method::radiosity) read_first_pass(*scene, points, irradiance);
  record_.seconds.rays = watch.seconds();
  return irradiance;
}

std::optional<std::vector<Rgb>> Run::irradiance_by_paths(std::span<const SensorPoint> points) {
  if (solution_ || options_.method || !options_.first_pass.given().empty()) return std::nullopt;
  const Stopwatch watch;
  const std::shared_ptr<const LitScene> scene = lit_scene();
  const std::optional<ProbeOptions> options = options_for_paths(scene, points, *parallel_, record_.traced_rays);
  if (!options) {
    spdlog::info("a first pass: paths from the points alone would cost more");
    return std::nullopt;
  }
  spdlog::info("no first pass: paths from the points reach a relative error of {:.2g} for less",
               *options->gather_error);
  std::vector<Rgb> irradiance;
  double squares = 0, all = 0;
  for (const PointLight& light : sensor_light(scene, points, *options, *parallel_, record_.traced_rays)) {
    irradiance.push_back(light.total());
    squares += 3 * light.standard_error * light.standard_error, all += glm::dot(light.total(), light.total());
  }
  record_.method = "paths";
  record_.more["error_estimate"] = all > 0 ? std::sqrt(squares / all) : 0.0;
  record_.seconds.rays = watch.seconds();
  return irradiance;
}

Run::Checked Run::check(const LitScenePtr& scene, const CheckPoints& places, const ErrorKnobs& knobs,
                        const ErrorCheckOptions& effort) {
  const Stopwatch watch;
  std::vector<SensorPoint> sensors;
  for (const CheckPoint& point : places.points) sensors.push_back({point.at.point, point.at.normal});
  const ProbeOptions reading = probe_options(knobs, places.points.size());
  std::vector<PointLight> light = sensor_light(scene, sensors, reading, *parallel_, record_.traced_rays);
  if (knobs.direct_is_solved())
    for (std::size_t i = 0; i < places.points.size(); ++i) {
      const SurfacePoint& at = places.points[i].at;
      if (!scene->has_elements(at)) continue;
      light[i].indirect = scene->indirect_irradiance(at);
      light[i].direct = scene->total_irradiance(at) - light[i].indirect;
    }
  Checked checked{check_error(scene, places, light, effort, *parallel_), unshot_share(*solution_), {}};
  if (!knobs.direct_is_solved()) {
    ProbeOptions again = reading;
    again.seed = mix64(effort.seed), again.direct_rounds *= 2;
    checked.noise = reading_noise(places, light, sensor_light(scene, sensors, again, *parallel_, record_.traced_rays),
                                  knobs.is_gathered());
  }
  record_.traced_rays += checked.estimate.rays;
  record_.seconds.check += watch.seconds();
  return checked;
}

std::vector<Estimate> Run::reference_irradiance(std::span<const SensorPoint> points, std::uint32_t samples) {
  const Stopwatch watch;
  std::vector<Estimate> estimates =
      lichthof::reference_irradiance(PathTracer(lit_scene()), points, samples, *parallel_, record_.traced_rays);
  record_.seconds.rays = watch.seconds();
  return estimates;
}

RunRecord& Run::record() {
  if (solution_) {
    record_.has_first_pass = true;
    record_.elements = mesh_->elements.size();
    record_.patches = mesh_->patches.size();
    record_.cells = solution_->options.cells;
    record_.energy = solution_->energy;
    record_.sides_dark = 0;
    for (const LitSides& lit : mesh_->lit_sides) record_.sides_dark += (lit.front ? 0u : 1u) + (lit.back ? 0u : 1u);
    record_.counters = solution_->counters;
    record_.converged = solution_->converged;
  }
  record_.seconds.total = since_start_.seconds();
  return record_;
}

}  // namespace lichthof::apps
