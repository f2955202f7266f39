#include "apps/cluster/lab.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

#include "actors/link/digest.hpp"
#include "apps/cluster/memory_room.hpp"
#include "apps/common/mesh_choice.hpp"
#include "apps/common/options.hpp"
#include "apps/common/progress.hpp"
#include "core/light/stopping.hpp"
#include "core/scene/partition.hpp"
#include "core/tracing/column_tracer.hpp"
#include "core/tracing/mirror_light.hpp"
#include "io/image_writer.hpp"
#include "io/scene_bytes.hpp"
#include "io/solution_file.hpp"

namespace lichthof::apps {

namespace {

using namespace std::chrono_literals;
using actors::JobView;
using actors::LabView;
using actors::NodeView;

constexpr std::chrono::milliseconds view_lives = 200ms, picture_lives = 60s;
constexpr std::uint32_t default_reference_samples = 64;
constexpr std::uint32_t most_pixels = 1u << 28;
/// A node's process with the whole solution, beside what each of its patches takes.
constexpr std::uint64_t process_bytes = 64u << 20, bytes_per_element = 200;

Error no_job(std::uint64_t id) { return {ErrorCode::bad_input, "job " + std::to_string(id), "there is none"}; }

Expected<std::string> contents_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::io, path, "can not be read"};
  return std::string{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Rows from top to bottom, as files hold them.
io::Image rows_of(const Image& image) {
  io::Image rows{image.width(), image.height(), std::vector<float>(3 * std::size_t{image.width()} * image.height())};
  for (std::uint32_t column = 0; column < image.width(); ++column)
    for (std::uint32_t row = 0; row < image.height(); ++row)
      for (int c = 0; c < 3; ++c)
        rows.rgb[3 * (std::size_t{row} * image.width() + column) + static_cast<std::size_t>(c)] =
            image.at(column, row)[c];
  return rows;
}

/// So that no two threads write the same temporary file.
std::string fresh_number() {
  static std::atomic<std::uint64_t> last{0};
  return std::to_string(++last);
}

/// As PNG, by way of a file, which is all that the library writes.
Expected<std::string> png_of(const io::Image& image, const std::string& folder) {
  const std::string path = folder + "/shown." + fresh_number() + ".png";
  if (Status written = io::write_image(path, image.view()); !written) return written.error();
  Expected<std::string> bytes = contents_of(path);
  std::error_code error;
  std::filesystem::remove(path, error);
  return bytes;
}

/// Between 0 and 1, of all passes.
double progress_of(const JobView& job) {
  if (job.job.state == JobState::done) return 1;
  const bool both = job.job.wish.radiosity && job.job.wish.picture;
  const double half = both ? 0.5 : 1;
  if (job.job.pass == Pass::radiosity) return half * share_of_way(job.radiosity);
  const double columns = job.columns > 0 ? static_cast<double>(job.columns_done) / job.columns : 0;
  return (both ? 0.5 : 0) + half * columns;
}

struct Rates {
  double busy_share = 0, shots_per_s = 0, rays_per_s = 0;
};

/// Of a node's actors, in their order: how far their counts have come between its last two reports.
std::vector<Rates> rates_of(const NodeView& node) {
  const double seconds = 1e-9 * static_cast<double>(node.report.at_ns - std::min(node.report.at_ns, node.before.at_ns));
  std::map<std::pair<JobId, std::string>, const actors::ActorLoad*> before;
  for (const actors::ActorLoad& load : node.before.actors) before[{load.job, load.name}] = &load;
  std::vector<Rates> all;
  for (const actors::ActorLoad& now : node.report.actors) {
    Rates& rates = all.emplace_back();
    const auto found = before.find({now.job, now.name});
    // A name that counts from zero again is another actor: of a later epoch.
    if (!(seconds > 0) || found == before.end() || now.busy_ns < found->second->busy_ns) continue;
    const auto rate = [seconds](std::uint64_t from, std::uint64_t to) {
      return static_cast<double>(to - std::min(from, to)) / seconds;
    };
    rates = {1e-9 * rate(found->second->busy_ns, now.busy_ns), rate(found->second->shots, now.shots),
             rate(found->second->rays, now.rays)};
  }
  return all;
}

double ratio(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

nlohmann::json document(const JobView& job, const std::vector<NodeView>& nodes) {
  nlohmann::json names = nlohmann::json::array();
  for (const NodeView& node : nodes)
    if (std::count(node.jobs.begin(), node.jobs.end(), job.id)) names.push_back(node.node.facts.name);
  const bool is_light_under_way = job.job.run && job.job.run->pass == Pass::radiosity;
  const std::uint64_t shots =
      is_light_under_way ? std::max(job.radiosity.shots, job.counters.shots) : job.counters.shots;
  const auto& grid = job.job.wish.grid;
  return {{"id", job.id.value},
          {"title", job.order.wish.title},
          {"owner", job.order.owner},
          {"state", name_of(job.job.state)},
          {"pass", job.job.run ? (job.job.pass == Pass::radiosity ? "radiosity" : "picture") : ""},
          {"progress", progress_of(job)},
          {"seconds", job.seconds},
          {"shots", shots},
          {"rays", job.counters.rays + job.rays},
          {"unshot_w", is_light_under_way ? sum_channels(job.radiosity.unshot_w) : job.energy.unshot},
          {"energy",
           {{"emitted", job.energy.emitted},
            {"absorbed", job.energy.absorbed},
            {"escaped", job.energy.escaped},
            {"unshot", job.energy.unshot},
            {"residual", job.energy.residual()},
            {"gain_direct", job.energy.gain_direct},
            {"gain_indirect", job.energy.gain_indirect}}},
          {"messages", job.counters.messages},
          {"bytes_sent", job.counters.bytes_sent},
          {"bytes_per_shot", ratio(job.counters.bytes_sent, job.counters.shots)},
          {"bytes_per_message", ratio(job.counters.bytes_sent, job.counters.messages)},
          {"reason", job.job.reason},
          {"nodes", names},
          {"cells", std::uint64_t{grid[0]} * grid[1] * grid[2]},
          {"epoch", job.job.epoch.value},
          {"checkpoint", job.job.has_checkpoint},
          {"columns_done", job.columns_done},
          {"columns", job.columns}};
}

// ---- What is wished for -----------------------------------------------------------------------------------------------

Error bad_option(const std::string& name, const std::string& what) { return {ErrorCode::bad_input, name, what}; }

/// A number of the options, within bounds. @error names the option
template <class T>
Expected<T> number(const nlohmann::json& options, const char* name, T otherwise, double least, double most) {
  const auto found = options.find(name);
  if (found == options.end()) return otherwise;
  if (!found->is_number()) return bad_option(name, "is no number");
  const double value = found->get<double>();
  if (!(value >= least && value <= most)) return bad_option(name, "is out of bounds");
  return static_cast<T>(value);
}

Expected<Camera> camera_of(const nlohmann::json& options) {
  const auto found = options.find("camera");
  if (found == options.end() || !found->is_object()) return bad_option("camera", "is missing");
  Camera camera;
  for (const auto& [name, vector] :
       {std::pair{"eye", &camera.eye}, std::pair{"target", &camera.target}, std::pair{"up", &camera.up}}) {
    const auto v = found->find(name);
    if (v == found->end() || !v->is_array() || v->size() != 3)
      return bad_option("camera", std::string(name) + " is no triple");
    for (int axis = 0; axis < 3; ++axis) {
      const auto& coordinate = (*v)[static_cast<std::size_t>(axis)];
      if (!coordinate.is_number()) return bad_option("camera", std::string(name) + " holds no number");
      (*vector)[axis] = coordinate.get<double>();
    }
  }
  const Expected<double> fov = number(*found, "fov_deg", 60.0, 1e-6, 180);
  if (!fov) return fov.error();
  camera.vertical_fov_deg = *fov;
  return checked(camera);
}

struct Wished {
  Method method = Method::two_pass;
  MeshOptions mesh;
  std::string cells;
  actors::PictureSpec picture;
  std::optional<double> eps;  ///< unset: default_eps()
  std::uint32_t hemicube = 128;
};

Expected<Wished> wished(const nlohmann::json& options, std::size_t nodes) {
  Wished w;
  const std::string method = options.value("method", "two-pass");
  const std::vector<std::string> names{"two-pass", "radiosity", "hemicube", "raytrace", "reference"};
  if (std::find(names.begin(), names.end(), method) == names.end())
    return bad_option("method", "'" + method + "' is not known");
  w.method = method_named(method);
  const bool is_reference = w.method == Method::reference;
  const auto patch = number(options, "patch_m", 0.0, 0, 1e9), element = number(options, "element_m", 0.0, 0, 1e9);
  const auto elements = number<std::uint32_t>(options, "elements", w.mesh.target_elements, 1, most_elements);
  const auto eps = number(options, "eps", SolveOptions{}.eps, 1e-12, 1);
  const auto hemicube = number<std::uint32_t>(options, "hemicube", w.hemicube, 2, 4096);
  const auto width = number<std::uint32_t>(options, "width", 640, 1, 65536),
             height = number<std::uint32_t>(options, "height", 480, 1, 65536);
  const auto samples = number<std::uint32_t>(
      options, "samples", is_reference ? default_reference_samples : TracingOptions{}.samples, 1, 1e6);
  const auto gather = number<std::uint32_t>(options, "gather", 0, 0, 1e6);
  for (const auto* value : {&patch, &element, &eps})
    if (!*value) return value->error();
  for (const auto* value : {&elements, &hemicube, &width, &height, &samples, &gather})
    if (!*value) return value->error();
  if (std::uint64_t{*width} * *height > most_pixels) return bad_option("width", "and height are more than 2^28 pixels");
  if (*hemicube % 2 != 0) return bad_option("hemicube", "is odd");
  w.mesh = {*patch, *element, *elements};
  if (options.contains("eps")) w.eps = *eps;
  w.hemicube = *hemicube;
  const Expected<Camera> camera = camera_of(options);
  if (!camera) return camera.error();
  w.picture.method = is_reference                    ? 255
                     : w.method == Method::radiosity ? static_cast<std::uint8_t>(TracingMethod::radiosity)
                     : w.method == Method::raytrace  ? static_cast<std::uint8_t>(TracingMethod::raytrace)
                                                     : static_cast<std::uint8_t>(TracingMethod::two_pass);
  w.picture.width = *width, w.picture.height = *height, w.picture.samples = *samples, w.picture.gather_rays = *gather;
  for (const Vec3& v : {camera->eye, camera->target, camera->up})
    w.picture.camera.insert(w.picture.camera.end(), {v.x, v.y, v.z});
  w.picture.camera.push_back(camera->vertical_fov_deg);
  // A cell for every node there is, unless somebody knows better.
  w.cells = options.value("cells", std::to_string(std::max<std::size_t>(1, nodes)));
  return w;
}

}  // namespace

Expected<std::unique_ptr<Lab>> Lab::open(LabOptions options) {
  std::unique_ptr<Lab> lab(new Lab(std::move(options)));
  const std::string folder = lab->options_.lead.folder;
  std::error_code error;
  for (const char* part : {"/scenes", "/logs"}) std::filesystem::create_directories(folder + part, error);
  if (error) return Error{ErrorCode::io, folder, "can not be written: " + error.message()};
  std::filesystem::permissions(folder, std::filesystem::perms::owner_all, error);
  actors::LeadOptions lead = lab->options_.lead;
  lead.read_solution = io::read_solution;
  lead.write_solution = io::write_solution;
  lead.write_picture = [](const std::string& path, const Image& image) {
    return io::write_image(path, rows_of(image).view());
  };
  lead.log = [raw = lab.get()](JobId job, const std::string& line) {
    char stamp[32];
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    gmtime_r(&now, &utc);
    std::strftime(stamp, sizeof stamp, "%FT%TZ ", &utc);
    std::ofstream(raw->log_path(job), std::ios::app) << stamp << line << '\n';
  };
  lead.forgotten = [raw = lab.get()](JobId job) {
    std::error_code ignored;
    std::filesystem::remove(raw->log_path(job), ignored);
    std::filesystem::remove(raw->png_path(job), ignored);
  };
  Expected<std::unique_ptr<actors::Lead>> started = actors::Lead::start(lead);
  if (!started) return started.error();
  lab->lead_ = std::move(*started);
  return lab;
}

std::string Lab::scene_path(const std::string& hash) const { return options_.lead.folder + "/scenes/" + hash; }
std::string Lab::log_path(JobId job) const { return options_.lead.folder + "/logs/" + std::to_string(job.value); }

std::string Lab::png_path(JobId job) const {
  return options_.lead.folder + "/results/" + std::to_string(job.value) + ".png";
}

LabView Lab::view() {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (now - viewed_ > view_lives) {
    view_ = lead_->view();
    viewed_ = now;
  }
  return view_;
}

nlohmann::json Lab::nodes() {
  const LabView seen = view();
  nlohmann::json all = nlohmann::json::array();
  for (const NodeView& node : seen.nodes) {
    double rays_per_s = 0;
    for (const Rates& rates : rates_of(node)) rays_per_s += rates.rays_per_s;
    nlohmann::json jobs = nlohmann::json::array();
    for (const JobId job : node.jobs) jobs.push_back(job.value);
    all.push_back({{"id", node.id.value},
                   {"name", node.node.facts.name},
                   {"host", node.host},
                   {"state", node.node.draining         ? "draining"
                             : node.node.pace.is_slow() ? "slow"
                             : node.jobs.empty()        ? "idle"
                                                        : "busy"},
                   {"cores", node.node.facts.cores},
                   {"rays_per_s", rays_per_s},
                   {"measured_rays_per_s", node.node.facts.rays_per_s * node.node.facts.cores},
                   {"memory_bytes", node.node.facts.memory_bytes},
                   {"free_memory_bytes", node.report.free_memory_bytes},
                   {"busy_share", std::clamp(node.report.busy_share, 0.0, 1.0)},
                   {"bytes_in", node.bytes_in},
                   {"bytes_out", node.bytes_out},
                   {"shots", node.report.shots},
                   {"rays", node.report.rays},
                   {"version", node.version},
                   {"jobs", jobs},
                   {"seen_s", node.seen_s}});
  }
  return all;
}

nlohmann::json Lab::actors() {
  const LabView seen = view();
  nlohmann::json all = nlohmann::json::array();
  for (const NodeView& node : seen.nodes) {
    const std::vector<Rates> rates = rates_of(node);
    for (std::size_t i = 0; i < rates.size(); ++i) {
      const actors::ActorLoad& now = node.report.actors[i];
      all.push_back({{"node", node.node.facts.name},
                     {"actor", now.name},
                     {"kind", now.name.substr(0, now.name.find(' '))},
                     {"job", now.job.value},
                     {"busy_share", std::clamp(rates[i].busy_share, 0.0, 1.0)},
                     {"mailbox", now.mailbox},
                     {"shots_per_s", rates[i].shots_per_s},
                     {"rays_per_s", rates[i].rays_per_s},
                     {"unshot_w", now.unshot_w},
                     {"bytes_in", now.bytes_in},
                     {"bytes_out", now.bytes_out},
                     {"memory_bytes", now.memory_bytes},
                     {"state", now.state}});
    }
  }
  return all;
}

nlohmann::json Lab::jobs(std::size_t most_ended) {
  const LabView seen = view();
  std::vector<const JobView*> ended;
  for (const JobView& job : seen.jobs)
    if (has_ended(job.job.state)) ended.push_back(&job);
  const auto later = [](const JobView* a, const JobView* b) { return a->ended_s > b->ended_s; };
  if (ended.size() > most_ended)
    std::nth_element(ended.begin(), ended.begin() + static_cast<std::ptrdiff_t>(most_ended), ended.end(), later);
  ended.resize(std::min(ended.size(), most_ended));
  const std::set<const JobView*> shown(ended.begin(), ended.end());
  nlohmann::json all = nlohmann::json::array();
  for (const JobView& job : seen.jobs)
    if (!has_ended(job.job.state) || shown.contains(&job)) all.push_back(document(job, seen.nodes));
  return all;
}

Expected<JobView> Lab::job_view(std::uint64_t id) {
  LabView now = lead_->view(JobId{id});
  if (now.jobs.empty()) return no_job(id);
  return std::move(now.jobs.front());
}

Expected<nlohmann::json> Lab::job(std::uint64_t id) {
  const LabView now = lead_->view(JobId{id});
  if (now.jobs.empty()) return no_job(id);
  return document(now.jobs.front(), now.nodes);
}

bool Lab::has_scene(const std::string& hash) {
  std::error_code error;
  if (!actors::is_sha256(hash) || !std::filesystem::is_regular_file(scene_path(hash), error)) return false;
  std::filesystem::last_write_time(scene_path(hash), std::filesystem::file_time_type::clock::now(),
                                   error);  // used just now
  return true;
}

Expected<std::string> Lab::add_scene(const std::string& bytes) {
  // What is no scene is not kept.
  if (const Expected<Scene> scene = io::scene_from_parcel(bytes, "the scene"); !scene) return scene.error();
  const std::string hash = actors::sha256_of(bytes), path = scene_path(hash),
                    partial = path + "." + fresh_number() + ".part";
  {
    std::ofstream file(partial, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!file.flush()) return Error{ErrorCode::io, partial, "can not be written"};
  }
  std::error_code error;
  std::filesystem::rename(partial, path, error);
  if (error) return Error{ErrorCode::io, path, "can not be written"};
  trim_scenes(hash);
  return hash;
}

/// A job has all it needs in the blob it begins with: a scene is only kept so that it need not be sent again.
void Lab::trim_scenes(const std::string& keep) {
  actors::trim_folder(options_.lead.folder + "/scenes", options_.scene_bytes, keep);
}

Expected<std::uint64_t> Lab::submit(const nlohmann::json& spec, const Caller& caller) {
  if (!spec.is_object() || !spec.contains("scene") || !spec["scene"].is_string())
    return bad_option("scene", "is missing");
  const std::string hash = spec["scene"];
  if (!has_scene(hash)) return bad_option("scene", "has not been handed in");
  const nlohmann::json options = spec.value("options", nlohmann::json::object());
  if (!options.is_object()) return bad_option("options", "are no object");
  const Expected<Wished> what = wished(options, view().nodes.size());
  if (!what) return what.error();
  const Expected<std::string> bytes = contents_of(scene_path(hash));
  if (!bytes) return bytes.error();
  Expected<Scene> scene = io::scene_from_parcel(*bytes, "the scene");
  if (!scene) return scene.error();

  Solution solution;
  MeshOptions sizes = what->mesh;
  if (sizes.patch_size <= 0 && scene->patch_size) sizes.patch_size = *scene->patch_size;
  solution.scene = std::make_shared<const Scene>(std::move(*scene));
  const Expected<ChosenMesh> mesh =
      mesh_for(*solution.scene, sizes, Parallel(options_.threads), memory_room().free_bytes);
  if (!mesh) return mesh.error();
  for (const std::string& line : mesh->warnings) spdlog::warn("job of scene {}: {}", hash, line);
  solution.mesh = mesh->mesh;
  const Expected<CellsWanted> wanted = cells_wanted(what->cells);
  if (!wanted) return wanted.error();
  Expected<CellGrid> grid = partition(*solution.mesh, bounds(*solution.scene), *wanted);
  if (!grid && !options.contains("cells")) grid = partition(*solution.mesh, bounds(*solution.scene), CellsWanted{});
  if (!grid) return grid.error();
  const TransferMethod method = what->method == Method::hemicube ? TransferMethod::hemicube : TransferMethod::rays;
  const double eps = what->eps ? *what->eps : default_eps(*solution.scene, *solution.mesh, method);
  solution.options = {sizes, grid->size(), what->hemicube, eps, method};

  if (has_first_pass(what->method))
    if (std::optional<Solution> begun =
            light_by_mirrors(solution.scene, solution.mesh, solution.options, Parallel(options_.threads)))
      solution = std::move(*begun);

  actors::JobOrder order;
  const std::string path = options_.lead.folder + "/begin." + hash.substr(0, 16) + "." + fresh_number();
  if (Status written = io::write_solution(path, solution); !written) return written.error();
  Expected<std::string> blob = lead_->blobs().adopt(path);
  if (!blob) return blob.error();
  order.solution = *blob;
  order.wish.title = spec.value("title", "scene").substr(0, 200);
  order.wish.radiosity = has_first_pass(what->method);
  order.wish.grid = grid->size();
  order.wish.patches = patch_counts(*solution.mesh, *grid);
  order.wish.base_bytes = process_bytes + bytes_per_element * solution.mesh->elements.size();
  order.picture = what->picture;
  order.eps = eps;
  order.owner = caller.name.substr(0, 100);
  Expected<JobId> id = lead_->submit(order);
  if (!id) return id.error();
  return id->value;
}

Status Lab::cancel(std::uint64_t job) { return lead_->cancel(JobId{job}); }
Status Lab::resume(std::uint64_t job) { return lead_->retry(JobId{job}); }
Status Lab::drain(const std::string& node, bool on) { return lead_->drain(node, on); }
Status Lab::kick(const std::string& node) { return lead_->kick(node); }

Expected<std::string> Lab::result(std::uint64_t id, const std::string& kind) {
  const Expected<JobView> job = job_view(id);
  if (!job) return job.error();
  Expected<std::string> bytes = result_of(*job, kind);
  if (bytes && has_ended(job->job.state)) lead_->fetched(job->id);
  return bytes;
}

Expected<std::string> Lab::result_of(const JobView& job, const std::string& kind) {
  const std::string number = std::to_string(job.id.value);
  const Error early{ErrorCode::failed, "job " + number, "has no such result yet"};
  if (kind == "solution.lht") {
    const std::optional<std::string> path =
        job.counters.shots > 0 || job.job.state == JobState::done ? lead_->blobs().find(job.solution) : std::nullopt;
    return path ? contents_of(*path) : Expected<std::string>(early);
  }
  const std::string path = options_.lead.folder + "/results/" + number + ".exr";
  std::error_code error;
  if (job.job.state != JobState::done || !std::filesystem::exists(path, error)) return early;
  if (kind == "image.exr") return contents_of(path);
  if (kind != "image.png") return Error{ErrorCode::bad_input, kind, "is no kind of result"};
  // Encoded once, whoever asks how often.
  const std::string encoded = png_path(job.id);
  if (std::filesystem::exists(encoded, error)) return contents_of(encoded);
  const Expected<io::Image> image = io::read_image(path);
  if (!image) return image.error();
  if (Status written = io::write_image(encoded, image->view()); !written) return written.error();
  return contents_of(encoded);
}

Expected<std::string> Lab::log(std::uint64_t id) {
  if (const Expected<JobView> job = job_view(id); !job) return job.error();
  std::error_code error;
  if (!std::filesystem::exists(log_path(JobId{id}), error)) return std::string{};
  return contents_of(log_path(JobId{id}));
}

nlohmann::json Lab::methods() {
  return {{{"name", "two-pass"},
           {"text", "direct light by rays, indirect light from the first pass, mirrors and glass by rays"}},
          {{"name", "radiosity"}, {"text", "the first pass as it is"}},
          {{"name", "hemicube"}, {"text", "two-pass, its first pass with the paper's item buffer"}},
          {{"name", "raytrace"}, {"text", "direct light by rays, a constant for the rest"}},
          {{"name", "reference"}, {"text", "unbiased path tracing"}}};
}

std::string Lab::metrics() {
  count();
  return figures_.text();
}

/// All who watch see the same picture. It is encoded no oftener than costs a hundredth of a core.
Expected<std::string> Lab::picture_so_far(std::uint64_t id) {
  const Expected<JobView> job = job_view(id);
  if (!job) return job.error();
  if (job->job.state == JobState::done) return result_of(*job, "image.png");
  const std::lock_guard lock(pictures_mutex_);
  const auto now = std::chrono::steady_clock::now();
  std::erase_if(pictures_, [&](const auto& kept) { return now - kept.second.made > picture_lives; });
  const auto found = pictures_.find(job->id);
  if (found != pictures_.end() && now < found->second.next) return found->second.png;
  Expected<Image> image = lead_->picture(JobId{id});
  if (!image) return image.error();
  Expected<std::string> png = png_of(rows_of(*image), options_.lead.folder);
  if (!png) return png.error();
  const auto made = std::chrono::steady_clock::now();
  pictures_[job->id] = {*png, made, made + 100 * (made - now)};
  return png;
}

}  // namespace lichthof::apps
