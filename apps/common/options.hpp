/// Options that several commands share: their names, defaults and bounds stand here once, so that they mean the same
/// everywhere.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "io/scene_reader.hpp"

namespace lichthof::apps {

class Interruption;

/// What `main` runs once the command line has been understood.
using Command = std::function<Status(Interruption&)>;

/// How a command talks.
struct OutputOptions {
  bool json = false;     ///< one JSON document on stdout, nothing else there
  bool quiet = false;    ///< neither progress nor summary; errors only
  bool verbose = false;  ///< the log says what was read and chosen
};

/// Everything about the first pass that can be set by hand; unset: the default, or what a solution was solved with.
struct FirstPassOptions {
  std::optional<std::string> cells;
  std::optional<double> eps;
  std::optional<std::uint32_t> hemicube;
  std::optional<double> patch, element;  ///< scene units
  std::optional<std::uint32_t> elements;

  /// The options that were given and choose the mesh, or anything at all; empty: none.
  std::string mesh_given() const;
  std::string given() const;
};

inline constexpr std::uint32_t default_hemicube = 128;
/// More elements than this are taken for a typing error: they would need some 10 GB.
inline constexpr std::uint32_t most_elements = 1u << 26;

/// Adds --json --quiet --verbose --version.
void add_output_options(CLI::App& command, OutputOptions& options);
/// Adds --unit --up.
void add_scene_options(CLI::App& command, io::ReadOptions& options);
/// Adds --cells --eps --hemicube --patch --element --elements.
void add_first_pass_options(CLI::App& command, FirstPassOptions& options);
/// Adds --threads; 0 stands for all.
void add_threads_option(CLI::App& command, unsigned& threads);
/// Adds --exposure. @param what  "the picture", "the colours"
void add_exposure_option(CLI::App& command, std::optional<double>& exposure_ev, const std::string& what);
/// The number of threads to use: what was asked for, else one per hardware thread.
unsigned threads_to_use(unsigned asked);

/// A finite number in [least, most], or above `least` when it is excluded; NaN and infinity are refused by name.
enum class Least { included, excluded };
CLI::Validator number_within(double least, double most, Least bound = Least::included);

/// Adds --size: "640x480", at most 2^28 pixels; `text` is what is shown and kept.
void add_size_option(CLI::App& command, std::string& text);
/// Reads such a text. @returns false: it is something else
bool read_size(const std::string& text, std::uint32_t& width, std::uint32_t& height);

/// One of a few words.
CLI::Validator one_of(std::vector<std::string> words);

/// How light is computed; `lichthof render --help` says what each is for.
enum class Method : std::uint8_t { two_pass, radiosity, raytrace, hemicube, reference };
/// Adds --method with the names a command offers; the first is the default.
void add_method_option(CLI::App& command, std::optional<std::string>& method, const std::vector<std::string>& names);
Method method_named(const std::string& name);
const char* name_of(Method method);
/// Whether light is taken from a solution.
inline bool has_first_pass(Method method) { return method != Method::raytrace && method != Method::reference; }

}  // namespace lichthof::apps
