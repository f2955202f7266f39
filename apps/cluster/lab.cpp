#include "apps/cluster/lab.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "actors/link/digest.hpp"
#include "apps/common/mesh_choice.hpp"
#include "apps/common/options.hpp"
#include "apps/common/progress.hpp"
#include "core/scene/partition.hpp"
#include "core/tracing/column_tracer.hpp"
#include "io/image_writer.hpp"
#include "io/scene_bytes.hpp"
#include "io/solution_file.hpp"

namespace lichthof::apps {

namespace {

using namespace std::chrono_literals;
using actors::JobView;
using actors::LabView;
using actors::NodeView;

constexpr auto view_lives = 200ms, sample_every = 900ms;
constexpr std::uint32_t default_samples = 4, default_reference_samples = 64;
constexpr std::uint32_t most_pixels = 1u << 28;

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
            {"residual", job.energy.residual()}}},
          {"messages", job.counters.messages},
          {"bytes_sent", job.counters.bytes_sent},
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
  double eps = 5e-4;
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
  const auto eps = number(options, "eps", w.eps, 1e-12, 1);
  const auto hemicube = number<std::uint32_t>(options, "hemicube", w.hemicube, 2, 4096);
  const auto width = number<std::uint32_t>(options, "width", 640, 1, 65536),
             height = number<std::uint32_t>(options, "height", 480, 1, 65536);
  const auto samples =
      number<std::uint32_t>(options, "samples", is_reference ? default_reference_samples : default_samples, 1, 1e6);
  const auto gather = number<std::uint32_t>(options, "gather", 0, 0, 1e6);
  for (const auto* value : {&patch, &element, &eps})
    if (!*value) return value->error();
  for (const auto* value : {&elements, &hemicube, &width, &height, &samples, &gather})
    if (!*value) return value->error();
  if (std::uint64_t{*width} * *height > most_pixels) return bad_option("width", "and height are more than 2^28 pixels");
  if (*hemicube % 2 != 0) return bad_option("hemicube", "is odd");
  w.mesh = {*patch, *element, *elements};
  w.eps = *eps, w.hemicube = *hemicube;
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
  Expected<std::unique_ptr<actors::Lead>> started = actors::Lead::start(lead);
  if (!started) return started.error();
  lab->lead_ = std::move(*started);
  return lab;
}

std::string Lab::scene_path(const std::string& hash) const { return options_.lead.folder + "/scenes/" + hash; }
std::string Lab::log_path(JobId job) const { return options_.lead.folder + "/logs/" + std::to_string(job.value); }

LabView Lab::view() {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (now - viewed_ > view_lives) {
    view_ = lead_->view();
    viewed_ = now;
  }
  if (now - sampled_ > sample_every) sample(view_);
  return view_;
}

/// Counts become rates between two looks.
void Lab::sample(const LabView& view) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - sampled_).count();
  sampled_ = now;
  std::map<ActorKey, Load> loads;
  for (const NodeView& node : view.nodes)
    for (const std::string& line : node.report.actors) {
      std::istringstream in(line);
      std::string name, job;
      std::uint64_t arrived = 0;
      Load load;
      std::getline(in, name, '\t'), std::getline(in, job, '\t');
      in >> load.busy_ns >> load.depth >> arrived >> load.steps >> load.shots >> load.rays;
      const ActorKey key{node.id.value, name + '\t' + job};
      if (const auto before = loads_.find(key); before != loads_.end() && load.busy_ns >= before->second.busy_ns) {
        load.busy_share = 1e-9 * static_cast<double>(load.busy_ns - before->second.busy_ns) / seconds;
        load.shots_per_s = static_cast<double>(load.shots - std::min(load.shots, before->second.shots)) / seconds;
        load.rays_per_s = static_cast<double>(load.rays - std::min(load.rays, before->second.rays)) / seconds;
      }
      loads[key] = load;
    }
  loads_ = std::move(loads);
}

nlohmann::json Lab::nodes() {
  const LabView seen = view();
  nlohmann::json all = nlohmann::json::array();
  for (const NodeView& node : seen.nodes) {
    double rays_per_s = 0;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [key, load] : loads_)
        if (key.first == node.id.value) rays_per_s += load.rays_per_s;
    }
    nlohmann::json jobs = nlohmann::json::array();
    for (const JobId job : node.jobs) jobs.push_back(job.value);
    all.push_back({{"id", node.id.value},
                   {"name", node.node.facts.name},
                   {"host", node.host},
                   {"state", node.node.draining  ? "draining"
                             : node.jobs.empty() ? "idle"
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
  const std::lock_guard lock(mutex_);
  nlohmann::json all = nlohmann::json::array();
  for (const auto& [key, load] : loads_) {
    const auto node =
        std::find_if(seen.nodes.begin(), seen.nodes.end(), [&](const NodeView& n) { return n.id.value == key.first; });
    if (node == seen.nodes.end()) continue;
    const std::string name = key.second.substr(0, key.second.find('\t'));
    const std::uint64_t job = std::strtoull(key.second.c_str() + name.size() + 1, nullptr, 10);
    double unshot_w = 0;
    for (const JobView& one : seen.jobs)
      if (one.id.value == job)
        for (const CellReport& report : one.cells)
          if (name == "cell " + std::to_string(report.cell.value)) unshot_w = sum_channels(report.unshot_w);
    all.push_back({{"node", node->node.facts.name},
                   {"actor", name},
                   {"kind", name.substr(0, name.find(' '))},
                   {"job", job},
                   {"busy_share", std::clamp(load.busy_share, 0.0, 1.0)},
                   {"mailbox", load.depth},
                   {"shots_per_s", load.shots_per_s},
                   {"rays_per_s", load.rays_per_s},
                   {"unshot_w", unshot_w},
                   {"bytes_in", 0},
                   {"bytes_out", 0},
                   {"memory_bytes", 0},
                   {"state", load.busy_share > 0.01 ? "busy" : "idle"}});
  }
  return all;
}

nlohmann::json Lab::jobs() {
  const LabView seen = view();
  nlohmann::json all = nlohmann::json::array();
  for (const JobView& job : seen.jobs) all.push_back(document(job, seen.nodes));
  return all;
}

Expected<JobView> Lab::job_view(std::uint64_t id) {
  for (JobView& job : lead_->view().jobs)
    if (job.id.value == id) return std::move(job);
  return no_job(id);
}

Expected<nlohmann::json> Lab::job(std::uint64_t id) {
  const LabView now = lead_->view();
  for (const JobView& job : now.jobs)
    if (job.id.value == id) return document(job, now.nodes);
  return no_job(id);
}

bool Lab::has_scene(const std::string& hash) {
  std::error_code error;
  return actors::is_sha256(hash) && std::filesystem::is_regular_file(scene_path(hash), error);
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
  return hash;
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
  const Expected<std::shared_ptr<const Mesh>> mesh = mesh_for(*solution.scene, sizes, Parallel(options_.threads));
  if (!mesh) return mesh.error();
  solution.mesh = *mesh;
  const Expected<CellsWanted> wanted = cells_wanted(what->cells);
  if (!wanted) return wanted.error();
  Expected<CellGrid> grid = partition(*solution.mesh, bounds(*solution.scene), *wanted);
  if (!grid && !options.contains("cells")) grid = partition(*solution.mesh, bounds(*solution.scene), CellsWanted{});
  if (!grid) return grid.error();
  solution.options = {sizes, grid->size(), what->hemicube, what->eps,
                      what->method == Method::hemicube ? TransferMethod::hemicube : TransferMethod::rays};

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
  order.wish.base_bytes = 200u << 20;
  order.picture = what->picture;
  order.eps = what->eps;
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
  const Error early{ErrorCode::failed, "job " + std::to_string(id), "has no such result yet"};
  if (kind == "solution.lht") {
    const std::optional<std::string> path =
        job->counters.shots > 0 || job->job.state == JobState::done ? lead_->blobs().find(job->solution) : std::nullopt;
    return path ? contents_of(*path) : Expected<std::string>(early);
  }
  const std::string path = options_.lead.folder + "/results/" + std::to_string(id) + ".exr";
  std::error_code error;
  if (job->job.state != JobState::done || !std::filesystem::exists(path, error)) return early;
  if (kind == "image.exr") return contents_of(path);
  if (kind != "image.png") return Error{ErrorCode::bad_input, kind, "is no kind of result"};
  const Expected<io::Image> image = io::read_image(path);
  if (!image) return image.error();
  return png_of(*image, options_.lead.folder);
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

Expected<std::string> Lab::picture_so_far(std::uint64_t id) {
  const Expected<JobView> job = job_view(id);
  if (!job) return job.error();
  if (job->job.state == JobState::done) return result(id, "image.png");
  Expected<Image> image = lead_->picture(JobId{id});
  if (!image) return image.error();
  return png_of(rows_of(*image), options_.lead.folder);
}

}  // namespace lichthof::apps
