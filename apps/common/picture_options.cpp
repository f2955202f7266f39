#include "apps/common/picture_options.hpp"

namespace lichthof::apps {

void add_picture_options(CLI::App& command, PictureOptions& options) {
  command
      .add_option(
          "--camera", options.camera,
          "\"EYE; TARGET; UP; FOV\" in scene units, or the name of one in the scene file (default: its first, else "
          "one that frames the scene)")
      ->option_text("CAMERA");
  add_size_option(command, options.size);
  command.add_option("--samples", options.samples, "rays per pixel (default 8; reference 64)")
      ->check(number_within(1, 1 << 20))
      ->option_text("N");
  command
      .add_option("--gather", options.gather_rays, "rays of a final gather at each point seen, 0 for none (default 0)")
      ->check(number_within(0, 65536))
      ->option_text("N");
  add_exposure_option(command, options.exposure_ev, "a .png");
  command.add_option("--solution", options.solution, "keep the first pass in this file")->option_text("FILE");
}

Status picture_fits(const PictureOptions& options, Method method) {
  const auto is_refused = [&](const char* option, const char* why) {
    return Error{ErrorCode::bad_input, option, std::string("method ") + name_of(method) + why};
  };
  if (!options.solution.empty() && !has_first_pass(method))
    return is_refused("--solution", " has no first pass to keep");
  if (options.gather_rays.value_or(0) > 0 && method != Method::two_pass && method != Method::hemicube)
    return is_refused("--gather", " gathers nothing");
  return Done{};
}

}  // namespace lichthof::apps
