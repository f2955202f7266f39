#include "io/image_codec.hpp"

#include <dlfcn.h>

#include <filesystem>

namespace lichthof::io {

namespace {

constexpr const char* module_name = "lichthof_images.so";

Expected<const ImageCodec*> load() {
  std::error_code problem;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", problem).parent_path();
  std::string reasons;
  for (const std::filesystem::path& place : {folder / module_name, folder / "../lib/lichthof" / module_name}) {
    // Never closed: libraries below it register what runs at the program's end.
    if (void* module = dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL)) {
      const auto entry = reinterpret_cast<decltype(&lichthof_image_codec)>(dlsym(module, "lichthof_image_codec"));
      if (entry != nullptr) return entry();
    }
    const char* reason = dlerror();
    reasons += (reasons.empty() ? "" : "; ") + std::string(reason != nullptr ? reason : "unknown error");
  }
  return Error{
      ErrorCode::failed, module_name,
      "can't be loaded, so pictures can't be read or written; install lichthof and OpenImageIO anew (" + reasons + ")"};
}

}  // namespace

Expected<const ImageCodec*> image_codec() {
  static const Expected<const ImageCodec*> codec = load();
  return codec;
}

}  // namespace lichthof::io
