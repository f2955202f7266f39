#include "apps/common/files.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>

#include "io/atomic_file.hpp"

namespace lichthof::apps {

std::string ending_of(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

Status output_ready(const std::string& path, const std::vector<std::string>& endings,
                    std::initializer_list<std::string> inputs) {
  if (!endings.empty() && std::find(endings.begin(), endings.end(), ending_of(path)) == endings.end()) {
    std::string names;
    for (std::size_t i = 0; i < endings.size(); ++i)
      names += (i == 0 ? "" : i + 1 == endings.size() ? " or " : ", ") + endings[i];
    return Error{ErrorCode::bad_input, path, "unknown kind of output; a name that ends in " + names + " was expected"};
  }
  for (const std::string& input : inputs) {
    std::error_code ignored;
    if (std::filesystem::equivalent(path, input, ignored))
      return Error{ErrorCode::bad_input, path, "would overwrite the input; give another name after -o"};
  }
  return io::writable(path);
}

}  // namespace lichthof::apps
