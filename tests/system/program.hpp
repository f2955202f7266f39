/// The built program as its users meet it: a command line, exit status, stdout, stderr, files. Tests of the whole see
/// nothing else.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace lichthof::testing {

/// A folder that goes away with everything in it.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  /// Full name of a file in it.
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  /// Writes a file. @returns its full name
  std::string write(const std::string& name, const std::string& text) const;
  bool has(const std::string& name) const;
  /// Names of all files in it, hidden ones too, but for those the tests keep output in.
  std::vector<std::string> files() const;

 private:
  std::string path_;
};

std::string contents(const std::string& path);

struct Outcome {
  int status = -1;  ///< exit status; 128 + n when signal n ended it
  std::string out, err;
  double seconds = 0;  ///< for Process: since its last signal
  /// What stands on stdout, which must be one JSON document.
  nlohmann::json json() const;
  /// Whether stderr is one line that begins with "lichthof: " and holds `part`.
  bool complains(const std::string& part) const;
};

struct Surroundings {
  std::optional<std::uint64_t> largest_file;  ///< bytes, like ulimit -f
  std::string stdout_to;                      ///< a file instead of a pipe
  std::string stdin_from = "/dev/null";
};

/// A run under way.
class Process {
 public:
  explicit Process(const std::vector<std::string>& arguments, const Surroundings& around = {});
  ~Process();
  Process(const Process&) = delete;
  /// Waits until stderr holds a text. @returns false when the program ended, or a minute passed, without it
  bool says(const std::string& text);
  void signal(int number);
  pid_t id() const { return pid_; }
  /// What it has said on stderr so far.
  std::string said() const { return contents(folder_ / "err"); }
  /// Waits for the end, at most two minutes.
  Outcome finish();

 private:
  Folder folder_;
  pid_t pid_ = -1;
  std::string out_;
  double since_ = 0;
};

Outcome ran(const std::vector<std::string>& arguments, const Surroundings& around = {});

/// A closed room of 4 x 3 x 2.5 m with a panel of light under its ceiling and a box on its floor, in a folder, as room.obj
/// with room.mtl and room.toml (cameras "door" and "window").
void write_room(const Folder& folder);
/// A closed unit cube: every face shines with Ke 1 and reflects `reflectance`.
void write_furnace(const Folder& folder, double reflectance);
/// Points on floor and walls of the room, and in free air; on the faces of the unit cube.
std::string room_points();
std::string cube_points();

/// The columns after the first six of a CSV of results, row by row.
std::vector<std::vector<double>> results_of(const std::string& path);

}  // namespace lichthof::testing
