/// `lichthof doctor`: what is wrong with this machine, or with its place in a cluster, one line each, with the mend.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <system_error>

#include "apps/cluster/cluster_checks.hpp"
#include "apps/commands.hpp"
#include "apps/common/log.hpp"
#include "apps/common/machine.hpp"
#include "apps/common/report.hpp"
#include "apps/pipeline.hpp"
#include "io/atomic_file.hpp"
#include "io/image_writer.hpp"

namespace lichthof::apps {

namespace {

/// A closed unit cube that shines and reflects half of what it gets: the irradiance is pi / (1 - 1/2) everywhere.
constexpr const char* furnace_obj =
    "mtllib furnace.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nusemtl wall\n"
    "f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
constexpr const char* furnace_mtl = "newmtl wall\nKd 0.5 0.5 0.5\nKe 1 1 1\nillum 1\n";
constexpr double furnace_irradiance = 2 * std::numbers::pi, furnace_tolerance = 0.01;

/// A folder that goes away with everything in it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code problem;
    std::string name = (std::filesystem::temp_directory_path(problem) / "lichthof-XXXXXX").string();
    if (!problem && ::mkdtemp(name.data())) path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  bool exists() const { return !path_.empty(); }
  std::string file(const char* name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// Solves the furnace in two cells, so that every part takes its share: reader, mesh, rays, actors, bitmaps.
Expected<double> furnace_error(const TemporaryFolder& folder, const Interruption& interruption) {
  for (const auto& [name, text] : {std::pair{"furnace.obj", furnace_obj}, std::pair{"furnace.mtl", furnace_mtl}})
    if (Status written = io::write_file(folder.file(name), text); !written) return written.error();
  RunOptions options;
  options.input = folder.file("furnace.obj");
  options.first_pass.cells = "2";
  options.first_pass.elements = 600;
  options.talk.quiet = true;
  Run run("doctor", options, Method::radiosity, interruption);
  if (Status loaded = run.load(false); !loaded) return loaded.error();
  if (Status solved = run.solve(); !solved) return solved.error();
  double worst = 0;
  for (const Rgbf& irradiance : run.solution()->irradiance)
    worst = std::max(worst, std::abs(irradiance.y / furnace_irradiance - 1));
  return worst;
}

Finding solver(const Interruption& interruption) {
  const TemporaryFolder folder;
  const char* mend = "the installation is damaged: install lichthof and its libraries anew, and report this line";
  if (!folder.exists())
    return {"solver", Health::broken, "could not be tried without a temporary folder", "point TMPDIR to one"};
  const Stopwatch watch;
  const Expected<double> error = furnace_error(folder, interruption);
  if (!error) return {"solver", Health::broken, error.error().text(), mend};
  char text[96];
  std::snprintf(text, sizeof text, "a closed box with a known answer comes out within %.2g in %.2f s", *error,
                watch.seconds());
  const bool good = *error < furnace_tolerance;
  return {"solver", good ? Health::good : Health::broken, text, good ? "" : mend};
}

Finding pictures() {
  const TemporaryFolder folder;
  const std::vector<float> grey(12, 0.25f);
  for (const char* name : {"test.exr", "test.hdr", "test.png"}) {
    const std::string path = folder.file(name);
    const Status written = folder.exists() ? io::write_image(path, {2, 2, grey.data()}, {0.0}) : io::writable(path);
    const Expected<io::Image> back = written ? io::read_image(path) : Expected<io::Image>(written.error());
    if (!back || back->width != 2)
      return {"pictures", Health::broken, back ? std::string(name) + " reads back wrong" : back.error().text(),
              "install OpenImageIO anew (Debian: libopenimageio2.4)"};
  }
  return {"pictures", Health::good, ".exr .hdr .png can be written and read", ""};
}

const char* word(Health health) { return health == Health::good ? "ok" : health == Health::poor ? "poor" : "broken"; }

struct DoctorOptions {
  ClusterOptions cluster;
  OutputOptions talk;
};

Status doctor(const DoctorOptions& options, const Interruption& interruption) {
  const OutputOptions& talk = options.talk;
  log_as_asked(talk);
  // Pictures first: OpenImageIO is among the loaded libraries only after that.
  const Finding picture_files = pictures();
  std::vector<Finding> findings = machine_findings();
  findings.push_back(picture_files);
  findings.push_back(solver(interruption));
  if (!options.cluster.cluster.empty())
    for (Finding& finding : cluster_findings(options.cluster)) findings.push_back(std::move(finding));
  nlohmann::json checks = nlohmann::json::array();
  std::vector<std::string> lines;
  int broken = 0;
  for (const Finding& finding : findings) {
    broken += finding.health == Health::broken;
    checks.push_back(
        {{"name", finding.name}, {"health", word(finding.health)}, {"detail", finding.detail}, {"mend", finding.mend}});
    char start[48];
    std::snprintf(start, sizeof start, "%-7s %-17s ", word(finding.health), finding.name.c_str());
    lines.push_back(start + finding.detail + (finding.mend.empty() ? "" : " -> " + finding.mend));
  }
  const nlohmann::json document = {
      {"command", "doctor"}, {"version", LICHTHOF_VERSION}, {"good", broken == 0}, {"checks", std::move(checks)}};
  if (Status printed = print(talk, document, lines); !printed) return printed;
  if (broken == 0) return Done{};
  return Error{ErrorCode::failed, "",
               std::to_string(broken) + (broken == 1 ? " check" : " checks") + " failed; see the lines above"};
}

}  // namespace

void add_doctor(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App& command =
      *program.add_subcommand("doctor", "say what is wrong with this machine or a cluster, and the mend");
  add_cluster_options(command, options->cluster);
  add_output_options(command, options->talk);
  command.footer(
      "One line each: ok, poor (works, but slower or less than it could) or broken; after -> what to do.\n"
      "With --cluster also: names, addresses, certificates, ports, clocks, versions and nodes, as seen from here.\n"
      "Exit status: 1 when something is broken.\n"
      "\nExamples:\n"
      "  lichthof doctor\n"
      "  lichthof doctor --cluster lab7 --authority ca.crt --certificate me.crt --key me.key\n"
      "  lichthof doctor --json");
  command.callback([options, &chosen] {
    chosen = [options](Interruption& interruption) { return doctor(*options, interruption); };
  });
}

}  // namespace lichthof::apps
