/// Names of files on the command line, looked at before any work begins.
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "core/base/expected.hpp"

namespace lichthof::apps {

/// The end of a name in small letters, with its dot: ".exr".
std::string ending_of(const std::string& path);

/// Whether a file can be written under this name.
/// @param endings  those that choose a format; empty: any name will do
/// @param inputs   files that must not be overwritten by it
/// @error bad_input: another ending, or one of the inputs; io: missing folder, no permission
Status output_ready(const std::string& path, const std::vector<std::string>& endings,
                    std::initializer_list<std::string> inputs);

}  // namespace lichthof::apps
