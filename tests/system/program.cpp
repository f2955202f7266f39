#include "tests/system/program.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>

namespace lichthof::testing {

namespace fs = std::filesystem;

namespace {

constexpr double most_seconds = 120;

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void redirect(int stream, const std::string& path) {
  const int how = stream == STDIN_FILENO ? O_RDONLY : O_WRONLY | O_CREAT;
  const int file = ::open(path.c_str(), how | O_CLOEXEC, 0644);
  if (file < 0 || ::dup2(file, stream) < 0) ::_exit(126);
}

using Corner = std::array<double, 3>;

/// The four corners of a rectangle as an OBJ face of its own, counter-clockwise seen from its front; or as many as its tiles.
class ObjText {
 public:
  explicit ObjText(const std::string& head, double tiles_per_m = 0) : tiles_per_m_(tiles_per_m) { text_ << head; }
  void material(const char* name) { text_ << "usemtl " << name << "\n"; }
  void face(const std::array<Corner, 4>& corners) {
    const auto& [a, b, c, d] = corners;
    const int columns = tiles(a, b), rows = tiles(a, d);
    const auto point = [&](int column, int row) {
      const double u = static_cast<double>(column) / columns, v = static_cast<double>(row) / rows;
      text_ << "v";
      for (std::size_t k = 0; k < 3; ++k) text_ << " " << a[k] + u * (b[k] - a[k]) + v * (d[k] - a[k]);
      text_ << "\n";
    };
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        point(column, row), point(column + 1, row), point(column + 1, row + 1), point(column, row + 1);
        text_ << "f -4 -3 -2 -1\n";
      }
  }
  /// All six sides of a box, fronts inwards or outwards; the ground only where `with_ground`.
  void box(const Corner& a, const Corner& b, bool inwards, bool with_ground) {
    const auto both = [&](Corner p, Corner q, Corner r, Corner s) {
      inwards ? face({p, q, r, s}) : face({s, r, q, p});
    };
    if (with_ground) both({a[0], a[1], a[2]}, {b[0], a[1], a[2]}, {b[0], b[1], a[2]}, {a[0], b[1], a[2]});
    both({a[0], a[1], b[2]}, {a[0], b[1], b[2]}, {b[0], b[1], b[2]}, {b[0], a[1], b[2]});
    both({a[0], a[1], a[2]}, {a[0], a[1], b[2]}, {b[0], a[1], b[2]}, {b[0], a[1], a[2]});
    both({a[0], b[1], a[2]}, {b[0], b[1], a[2]}, {b[0], b[1], b[2]}, {a[0], b[1], b[2]});
    both({a[0], a[1], a[2]}, {a[0], b[1], a[2]}, {a[0], b[1], b[2]}, {a[0], a[1], b[2]});
    both({b[0], a[1], a[2]}, {b[0], a[1], b[2]}, {b[0], b[1], b[2]}, {b[0], b[1], a[2]});
  }
  std::string text() const { return text_.str(); }

 private:
  int tiles(const Corner& from, const Corner& to) const {
    const double length = std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    return std::max(1, static_cast<int>(std::lround(tiles_per_m_ * length)));
  }

  double tiles_per_m_;
  std::ostringstream text_;
};

}  // namespace

// ---- Files ------------------------------------------------------------------------------------------------------------

Folder::Folder() {
  path_ = (fs::temp_directory_path() / "lichthof-test-XXXXXX").string();
  REQUIRE(::mkdtemp(path_.data()) != nullptr);
}

Folder::~Folder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::string Folder::write(const std::string& name, const std::string& text) const {
  const std::string path = *this / name;
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

bool Folder::has(const std::string& name) const { return fs::exists(*this / name); }

std::vector<std::string> Folder::files() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(path_)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// ---- Runs -------------------------------------------------------------------------------------------------------------

nlohmann::json Outcome::json() const {
  const nlohmann::json document = nlohmann::json::parse(out, nullptr, false);
  INFO("stdout: " << out << "\nstderr: " << err);
  REQUIRE(document.is_object());
  return document;
}

bool Outcome::complains(const std::string& part) const {
  const bool one_line = std::count(err.begin(), err.end(), '\n') == 1 && err.back() == '\n';
  const bool good = one_line && err.starts_with("lichthof: ") && err.find(part) != std::string::npos;
  if (!good) MESSAGE("stderr is: " << err << " instead of one line with: " << part);
  return good;
}

Process::Process(const std::vector<std::string>& arguments, const Surroundings& around)
    : out_(around.stdout_to.empty() ? folder_ / "out" : around.stdout_to) {
  std::vector<std::string> words = arguments;
  words.insert(words.begin(), LICHTHOF_PROGRAM);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const std::string err = folder_ / "err";
  since_ = now_s();
  // A signal for the program that comes before it has begun must not find the handlers of the tests.
  sigset_t all, before;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  pid_ = ::fork();
  if (pid_ != 0) ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  REQUIRE(pid_ >= 0);
  if (pid_ > 0) return;
  for (const int number : {SIGTERM, SIGINT}) ::signal(number, SIG_DFL);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  redirect(STDIN_FILENO, around.stdin_from);
  redirect(STDOUT_FILENO, out_);
  redirect(STDERR_FILENO, err);
  if (around.network >= 0 && ::setns(around.network, CLONE_NEWNET) != 0) ::_exit(126);
  if (around.largest_file) {
    const rlimit limit{*around.largest_file, *around.largest_file};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

Process::~Process() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

bool Process::says(const std::string& text) {
  for (int tries = 0; tries < 6000; ++tries) {
    if (contents(folder_ / "err").find(text) != std::string::npos) return true;
    siginfo_t ended{};
    if (::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid == pid_)
      return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

void Process::signal(int number) {
  since_ = now_s();
  ::kill(pid_, number);
}

Outcome Process::finish() {
  // Nothing these tests start may take minutes: what hangs is ended, and fails by its status.
  int status = 0;
  pid_t ended = 0;
  for (double until = now_s() + most_seconds; (ended = ::waitpid(pid_, &status, WNOHANG)) == 0;) {
    if (now_s() > until) ::kill(pid_, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  REQUIRE(ended == pid_);
  pid_ = -1;
  Outcome outcome;
  outcome.seconds = now_s() - since_;
  outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  if (fs::is_regular_file(out_)) outcome.out = contents(out_);
  outcome.err = contents(folder_ / "err");
  return outcome;
}

Outcome ran(const std::vector<std::string>& arguments, const Surroundings& around) {
  Process process(arguments, around);
  return process.finish();
}

// ---- Scenes -----------------------------------------------------------------------------------------------------------

static void write_room(const Folder& folder, const std::string& name, double tiles_per_m) {
  folder.write("room.mtl",
               "newmtl wall\nKd 0.7 0.65 0.6\nnewmtl box\nKd 0.3 0.4 0.6\nnewmtl lamp\nKd 0.5 0.5 0.5\nKe 12 11 9\n");
  ObjText obj("mtllib room.mtl\n", tiles_per_m);
  obj.material("wall");
  obj.box({0, 0, 0}, {4, 3, 2.5}, true, true);
  obj.material("box");
  obj.box({0.6, 0.7, 0}, {1.4, 1.5, 1.1}, false, false);
  obj.material("lamp");
  obj.face({{{1.5, 1.9, 2.3}, {1.5, 2.4, 2.3}, {2.5, 2.4, 2.3}, {2.5, 1.9, 2.3}}});
  folder.write(name + ".obj", obj.text());
  folder.write(name + ".toml",
               "unit = \"m\"\n[[part]]\nfile = \"" + name +
                   ".obj\"\n"
                   "[[camera]]\nname = \"door\"\neye = [3.8, 0.2, 1.6]\ntarget = [0.5, 2.5, 0.8]\n"
                   "[[camera]]\nname = \"window\"\neye = [0.2, 2.8, 1.7]\ntarget = [3.5, 0.5, 0.5]\nfov = 70\n");
}

void write_room(const Folder& folder) { write_room(folder, "room", 0); }
void write_tiled_room(const Folder& folder) { write_room(folder, "tiles", 3); }

void write_furnace(const Folder& folder, double reflectance) {
  const std::string kd = std::to_string(reflectance);
  folder.write("furnace.mtl", "newmtl wall\nKd " + kd + " " + kd + " " + kd + "\nKe 1 1 1\n");
  ObjText obj("mtllib furnace.mtl\nusemtl wall\n");
  obj.box({0, 0, 0}, {1, 1, 1}, true, true);
  folder.write("furnace.obj", obj.text());
}

std::string room_points() {
  std::ostringstream csv;
  csv << "x,y,z,nx,ny,nz\n";
  for (double x : {0.3, 1.7, 2.4, 3.3, 3.8})
    for (double y : {0.2, 1.1, 1.8, 2.7}) csv << x << "," << y << ",0,0,0,1\n";
  for (double x : {0.4, 1.5, 2.6, 3.7})
    for (double z : {0.4, 1.2, 2.1}) csv << x << ",3," << z << ",0,-1,0\n" << x << ",0," << z << ",0,1,0\n";
  for (double x : {1.0, 2.0, 3.0}) csv << x << ",1.9,0.8,0,0,1\n" << x << ",1.9,0.8,1,0,0\n";
  return csv.str();
}

std::string cube_points() {
  std::ostringstream csv;
  csv << "x,y,z,nx,ny,nz\n";
  const double places[] = {0.004, 0.05, 0.21, 0.5, 0.73, 0.97};
  for (double a : places)
    for (double b : places)
      csv << a << "," << b << ",0,0,0,1\n"
          << a << "," << b << ",1,0,0,-1\n"
          << a << ",0," << b << ",0,1,0\n"
          << a << ",1," << b << ",0,-1,0\n0," << a << "," << b << ",1,0,0\n1," << a << "," << b << ",-1,0,0\n";
  return csv.str();
}

std::vector<std::vector<double>> results_of(const std::string& path) {
  std::istringstream text(contents(path));
  std::string line;
  std::getline(text, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(text, line)) {
    std::istringstream cells(line);
    std::vector<double> row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::strtod(cell.c_str(), nullptr));
    REQUIRE(row.size() > 6);
    rows.emplace_back(row.begin() + 6, row.end());
  }
  return rows;
}

}  // namespace lichthof::testing
