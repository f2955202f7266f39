// A lab in one process: a lead and nodes, each with an actor system of its own, over real sockets.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "actors/cluster/lead.hpp"
#include "actors/cluster/node.hpp"
#include "actors/local_run.hpp"
#include "core/tracing/picture_source.hpp"
#include "io/image_writer.hpp"
#include "io/solution_file.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/scratch_folder.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;
using namespace lichthof::actors;
using namespace std::chrono_literals;

namespace {

constexpr auto patience = 120s;  // for a busy machine; nothing takes so long unless it is broken
constexpr double eps = 1e-4;
/// Rays and hemicubes stand where a shot's light leaves, so what is transferred depends on how light is shared out among
/// shots, by some 2e-3 here: a fifth of what dividing the scene costs.
constexpr double order_of_shots = 5e-3;

Camera camera() { return {"", {0.5, 0.6, 1.5}, {6, 3, 0.8}, {0, 0, 1}, 70}; }

PictureSpec picture_spec() {
  PictureSpec spec;
  spec.method = static_cast<std::uint8_t>(TracingMethod::two_pass);
  spec.width = 48, spec.height = 32, spec.samples = 1;
  const Camera c = camera();
  spec.camera = {c.eye.x,    c.eye.y, c.eye.z, c.target.x, c.target.y,
                 c.target.z, c.up.x,  c.up.y,  c.up.z,     c.vertical_fov_deg};
  return spec;
}

/// A scene's mesh without light, as a job begins with.
Solution unlit(const CellPosition& cells, double patch_size = 0.5) {
  Solution solution;
  solution.scene = test::two_rooms();
  solution.mesh = test::mesh_with(*solution.scene, patch_size);
  solution.options.mesh = solution.mesh->options;
  solution.options.cells = cells;
  solution.options.eps = eps;
  for (auto* values : {&solution.irradiance, &solution.direct_irradiance, &solution.shot, &solution.pending})
    values->assign(solution.mesh->elements.size(), Rgbf{0.f});
  return solution;
}

std::shared_ptr<const CellGrid> grid_of(const Solution& solution) {
  CellsWanted wanted;
  wanted.along = solution.options.cells;
  return std::make_shared<const CellGrid>(*partition(*solution.mesh, bounds(*solution.scene), wanted));
}

Solution solved_here(const Solution& unlit) {
  SolveRun run;
  run.scene = unlit.scene, run.mesh = unlit.mesh, run.grid = grid_of(unlit), run.options = unlit.options;
  run.parallel = std::make_shared<const Parallel>(1);
  return solve(run);
}

class Lab {
 public:
  explicit Lab(Duration checkpoint_every = Duration{5'000'000'000}) : checkpoint_every_(checkpoint_every) {
    start_lead();
  }
  ~Lab() {
    for (auto& [name, node] : nodes_) stop(name);
  }

  void start_lead(std::uint16_t port = 0) {
    LeadOptions options;
    options.link.own = {"lead", Role::controller};
    options.port = port;
    options.folder = folder_ / "lead";
    options.dispatcher.checkpoint_every = checkpoint_every_;
    options.retention = retention;
    options.read_solution = io::read_solution;
    options.write_solution = io::write_solution;
    options.write_picture = [](const std::string& path, const Image& image) {
      std::vector<float> rows;
      for (std::uint32_t row = 0; row < image.height(); ++row)
        for (std::uint32_t column = 0; column < image.width(); ++column)
          for (int c = 0; c < 3; ++c) rows.push_back(image.at(column, row)[c]);
      return io::write_image(path, {image.width(), image.height(), rows.data()});
    };
    Expected<std::unique_ptr<Lead>> started = Lead::start(options);
    REQUIRE(started);
    lead = std::move(*started);
  }

  /// @param change  of the node's options
  void start(const std::string& name, const std::function<void(NodeOptions&)>& change = {}) {
    NodeOptions options;
    options.link.own = {name, Role::node};
    options.lead_host = "127.0.0.1", options.lead_port = lead->port();
    options.facts = {"", 1, 4ull << 30, 1e7};
    options.cache = folder_ / name;
    options.read_solution = io::read_solution;
    options.free_memory_bytes = [] { return 4ull << 30; };
    options.used_memory_bytes = [] { return 0ull; };
    if (change) change(options);
    Node& node = nodes_[name];
    node.stop = std::make_unique<std::atomic<bool>>(false);
    node.thread = std::thread([options, stop = node.stop.get()] { CHECK(run_node(options, *stop)); });
  }
  void stop(const std::string& name) {
    Node& node = nodes_[name];
    if (!node.thread.joinable()) return;
    *node.stop = true;
    node.thread.join();
  }

  JobOrder order(const Solution& solution, bool picture = true) {
    const std::string path = folder_ / "unlit.lht";
    REQUIRE(io::write_solution(path, solution));
    const Expected<std::string> hash = lead->blobs().adopt(path);
    REQUIRE(hash);
    JobOrder order;
    order.solution = *hash;
    order.eps = solution.options.eps;
    order.wish.title = "rooms";
    order.wish.picture = picture;
    order.wish.grid = solution.options.cells;
    order.wish.patches = patch_counts(*solution.mesh, *grid_of(solution));
    order.picture = picture_spec();
    order.owner = "test";
    return order;
  }

  template <class Condition>
  bool until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < end) {
      if (condition()) return true;
      std::this_thread::sleep_for(20ms);
    }
    return false;
  }
  JobView job(JobId id) {
    for (JobView& job : lead->view().jobs)
      if (job.id == id) return std::move(job);
    return {};
  }
  bool until_over(JobId id) {
    return until([&] { return has_ended(job(id).job.state); });
  }
  Solution light_of(JobId id) {
    const std::optional<std::string> path = lead->blobs().find(job(id).solution);
    REQUIRE(path);
    Expected<Solution> solution = io::read_solution(*path);
    REQUIRE(solution);
    return std::move(*solution);
  }
  std::size_t files(const std::string& name) const {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_ / ("lead/" + name))) ++count;
    return count;
  }
  std::string result(JobId id) const { return folder_ / ("lead/results/" + std::to_string(id.value) + ".exr"); }

  std::unique_ptr<Lead> lead;
  RetentionOptions retention;  ///< of the next lead

 private:
  struct Node {
    std::unique_ptr<std::atomic<bool>> stop;
    std::thread thread;
  };
  Duration checkpoint_every_;
  test::ScratchFolder folder_;
  std::map<std::string, Node> nodes_;
};

}  // namespace

TEST_SUITE("cluster") {
  TEST_CASE("cluster: three nodes give the light of one process, and the picture bit for bit") {
    Lab lab;
    for (const char* name : {"anna", "bert", "carl"}) lab.start(name);
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.size() == 3; }));
    const Solution start = unlit({2, 2, 1});
    const Expected<JobId> id = lab.lead->submit(lab.order(start));
    REQUIRE(id);
    REQUIRE(lab.until_over(*id));
    const JobView job = lab.job(*id);
    INFO(job.job.reason);
    REQUIRE(job.job.state == JobState::done);

    const Solution far = lab.light_of(*id), here = solved_here(start);
    CHECK(far.converged);
    CHECK(test::relative_rms(far, here) < order_of_shots);
    CHECK(far.energy.emitted == doctest::Approx(here.energy.emitted).epsilon(1e-9));
    CHECK(std::abs(far.energy.residual() - here.energy.residual()) < 1e-3);
    CHECK(far.counters.messages > 0);

    PictureWish wish;
    wish.camera = camera();
    wish.width = 48, wish.height = 32, wish.samples = 1;
    std::uint64_t rays = 0;
    const std::vector<Rgbf> expected = picture_source(std::make_shared<LitScene>(far), wish)->columns({0, 48}, rays);
    const Expected<io::Image> picture = io::read_image(lab.result(*id));
    REQUIRE(picture);
    for (std::uint32_t column = 0; column < 48; ++column)
      for (std::uint32_t row = 0; row < 32; ++row)
        for (int c = 0; c < 3; ++c)
          REQUIRE(picture->rgb[3 * (std::size_t{row} * 48 + column) + static_cast<std::size_t>(c)] ==
                  expected[std::size_t{column} * 32 + row][c]);
  }

  TEST_CASE("cluster: a node that dies takes nothing with it") {
    Lab lab(Duration{100'000'000});
    for (const char* name : {"anna", "bert"}) lab.start(name);
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.size() == 2; }));
    Solution start = unlit({2, 1, 1}, 0.2);
    start.options.eps = 1e-5;
    const Expected<JobId> id = lab.lead->submit(lab.order(start, false));
    REQUIRE(id);
    REQUIRE(lab.until([&] { return lab.job(*id).job.has_checkpoint || has_ended(lab.job(*id).job.state); }));
    lab.stop("bert");
    REQUIRE(lab.until_over(*id));
    INFO(lab.job(*id).job.reason);
    REQUIRE(lab.job(*id).job.state == JobState::done);
    const Solution far = lab.light_of(*id), here = solved_here(start);
    CHECK(far.converged);
    CHECK(test::relative_rms(far, here) < order_of_shots);
    CHECK(std::abs(far.energy.residual() - here.energy.residual()) < 1e-3);
  }

  TEST_CASE("cluster: a controller that restarts takes its jobs up again") {
    Lab lab(Duration{100'000'000});
    lab.start("anna");
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.size() == 1; }));
    Solution start = unlit({2, 1, 1}, 0.2);
    start.options.eps = 1e-5;
    const Expected<JobId> id = lab.lead->submit(lab.order(start));
    REQUIRE(id);
    REQUIRE(lab.until([&] { return lab.job(*id).job.has_checkpoint || has_ended(lab.job(*id).job.state); }));
    const std::uint16_t port = lab.lead->port();
    lab.lead.reset();
    lab.start_lead(port);
    REQUIRE(lab.until_over(*id));
    INFO(lab.job(*id).job.reason);
    CHECK(lab.job(*id).job.state == JobState::done);
  }

  TEST_CASE("cluster: a node that was drained stays so through a restart of the controller, until it is taken back") {
    Lab lab;
    lab.start("anna");
    const auto is_there = [&](bool is_draining) {
      const LabView view = lab.lead->view();
      return view.nodes.size() == 1 && view.nodes[0].node.draining == is_draining;
    };
    REQUIRE(lab.until([&] { return is_there(false); }));
    REQUIRE(lab.lead->drain("anna", true));
    const std::uint16_t port = lab.lead->port();
    lab.lead.reset();
    lab.start_lead(port);
    CHECK(lab.until([&] { return is_there(true); }));
    lab.stop("anna");
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.empty(); }));
    CHECK(!lab.lead->drain("bert", false));
    CHECK(lab.lead->drain("anna", false));
    lab.start("anna");
    CHECK(lab.until([&] { return is_there(false); }));
  }

  TEST_CASE("cluster: jobs that were fetched are forgotten with all they left, others stay and fill the lab") {
    Lab lab;
    lab.retention.most_jobs = 2;
    lab.lead.reset();
    lab.start_lead();
    lab.start("anna");
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.size() == 1; }));
    const auto done = [&](double patch_size) {
      const Expected<JobId> id = lab.lead->submit(lab.order(unlit({1, 1, 1}, patch_size)));
      REQUIRE(id);
      REQUIRE(lab.until_over(*id));
      REQUIRE(lab.job(*id).job.state == JobState::done);
      return *id;
    };
    const JobId first = done(0.5), second = done(0.6), third = done(0.7);
    const auto refused = lab.lead->submit(lab.order(unlit({1, 1, 1}, 0.8)));
    REQUIRE(!refused);
    CHECK(refused.error().text().find("nobody has fetched") != std::string::npos);
    CHECK(lab.files("blobs") == 6);  // what each began with, and its light: nothing of the refused one
    lab.lead->fetched(second);
    // Also by a controller that has been started anew.
    const std::uint16_t port = lab.lead->port();
    lab.lead.reset();
    lab.start_lead(port);
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.size() == 1; }));
    const JobId fourth = done(0.5);
    std::vector<JobId> known;
    for (const JobView& job : lab.lead->view().jobs) known.push_back(job.id);
    CHECK(known == std::vector<JobId>{first, third, fourth});
    CHECK(fourth == JobId{4});
    CHECK(!std::filesystem::exists(lab.result(second)));
    CHECK(lab.files("results") == 3);
    CHECK(lab.files("blobs") <= 6);  // the first and the fourth began with the same
    CHECK(!lab.lead->picture(second));
  }

  TEST_CASE("cluster: a picture goes on from its finished columns when the controller restarts") {
    Lab lab;
    lab.start("anna");
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.size() == 1; }));
    JobOrder order = lab.order(unlit({1, 1, 1}));
    order.picture.samples = 256;
    const Expected<JobId> id = lab.lead->submit(order);
    REQUIRE(id);
    REQUIRE(lab.until([&] { return lab.job(*id).columns_done >= 8 || has_ended(lab.job(*id).job.state); }));
    const std::uint16_t port = lab.lead->port();
    lab.lead.reset();
    lab.start_lead(port);
    std::uint32_t first_seen = 0;
    std::uint64_t rays_seen = 0;
    REQUIRE(lab.until([&] {
      const JobView job = lab.job(*id);
      if (first_seen == 0) first_seen = job.columns_done;
      rays_seen = std::max(rays_seen, job.rays);
      return has_ended(job.job.state);
    }));
    REQUIRE(lab.job(*id).job.state == JobState::done);
    CHECK(first_seen >= 8);

    const Solution far = lab.light_of(*id);
    PictureWish wish;
    wish.camera = camera();
    wish.width = 48, wish.height = 32, wish.samples = 256;
    std::uint64_t rays = 0;
    const std::vector<Rgbf> expected = picture_source(std::make_shared<LitScene>(far), wish)->columns({0, 48}, rays);
    CHECK(rays_seen > 0);
    CHECK(rays_seen <= rays);
    const Expected<io::Image> picture = io::read_image(lab.result(*id));
    REQUIRE(picture);
    for (std::uint32_t column = 0; column < 48; ++column)
      for (std::uint32_t row = 0; row < 32; ++row)
        REQUIRE(picture->rgb[3 * (std::size_t{row} * 48 + column)] == expected[std::size_t{column} * 32 + row].x);
  }

  TEST_CASE("cluster: a node without memory for its share refuses it, and the job waits and says why") {
    Lab lab;
    lab.start("anna", [](NodeOptions& options) { options.free_memory_bytes = [] { return 100'000'000ull; }; });
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.size() == 1; }));
    JobOrder order = lab.order(unlit({1, 1, 1}));
    order.wish.base_bytes = 1'000'000'000;
    const Expected<JobId> id = lab.lead->submit(order);
    REQUIRE(id);
    const auto said = [&](const std::string& what) { return lab.job(*id).job.reason.find(what) != std::string::npos; };
    // Before its first report the lab counts on all of its memory; the node knows better.
    REQUIRE(lab.until([&] { return said("free") || said("waits"); }));
    CHECK(lab.job(*id).job.state == JobState::queued);
    CHECK(!lab.job(*id).job.run);
  }

  TEST_CASE("cluster: a node told to end while it loads a run ends within seconds") {
    Lab lab;
    std::atomic<bool> is_loading = false, is_over = false;
    std::atomic<unsigned> abandoned = 0;
    lab.start("anna", [&](NodeOptions& options) {
      options.read_solution = [&](const std::string& path) {
        is_loading = true;
        while (!is_over) std::this_thread::sleep_for(10ms);
        return io::read_solution(path);
      };
      // A process would end here.
      options.abandon = [&] {
        ++abandoned;
        is_over = true;
      };
    });
    REQUIRE(lab.until([&] { return lab.lead->view().nodes.size() == 1; }));
    REQUIRE(lab.lead->submit(lab.order(unlit({1, 1, 1}))));
    REQUIRE(lab.until([&] { return is_loading.load(); }));
    const auto begin = std::chrono::steady_clock::now();
    lab.stop("anna");
    CHECK(std::chrono::steady_clock::now() - begin < 15s);  // promised: 5 s on a machine that is not busy
    CHECK(abandoned == 1);
  }
}
