#include "core/tracing/error_budget.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"

namespace lichthof {

namespace {

/// The four parts share the square of the error; a knob is turned when its part takes more than this share of it.
constexpr double fair_share = 0.25;
/// Convergence gets less: halving eps costs an eighth more, and half the error of elements twice the time and more.
constexpr double fair_share_of_unshot = 0.1;
/// At most this much further in one turn: the laws hold near by.
constexpr double longest_turn = 4;
constexpr double trust_in_pending = 0.5;
/// Powers by which the parts fall with their knobs: stratified rays; elements that are seen by a gather; elements that are read.
constexpr double ray_law = 0.7, seen_from_afar_law = 0.7, mesh_law = 0.5;
/// Unshot light at the same eps grows with the number of shooters: two_rooms, 19 000 to 112 000 elements, powers .53 and .69.
constexpr double unshot_law = 0.6;
constexpr std::uint32_t first_gather = 64;
/// Of the deviations: they are not quite the error, and less than half is not worth a turn.
constexpr double least_kept = 0.1, most_kept = 0.5;

/// How much further a knob goes so that its part shrinks to its share, if it falls with the knob's power `-law`.
double turn_for(double part, double wanted, double law, double share = fair_share) {
  const double excess = part / (std::sqrt(share) * wanted);
  return excess <= 1 ? 1.0 : std::clamp(std::pow(excess, 1 / law), 1.5, longest_turn);
}

std::uint32_t further(std::uint32_t knob, double turn, std::uint32_t most) {
  return static_cast<std::uint32_t>(std::min(std::ceil(knob * turn), static_cast<double>(most)));
}

}  // namespace

const char* name_of(ErrorPart part) {
  constexpr std::array<const char*, 4> names{"visibility", "reconstruction", "discretisation", "convergence"};
  return names[static_cast<std::size_t>(part)];
}

ErrorPart ErrorParts::dominant() const {
  const std::array<double, 4> all{visibility, reconstruction, discretisation, convergence};
  return static_cast<ErrorPart>(std::max_element(all.begin(), all.end()) - all.begin());
}

ErrorParts parts_of(const ErrorEstimate& estimate, double unshot, const ReadingNoise& noise) {
  const auto rest = [](double whole, double part) { return std::sqrt(std::max(0.0, whole * whole - part * part)); };
  ErrorParts parts;
  parts.visibility = noise.direct.value_or(estimate.visibility);
  parts.reconstruction = noise.indirect.value_or(rest(estimate.indirect, estimate.solution));
  // Where paths tell, the walks' parts are mostly noise: what noise of reading leaves is an error of the solution.
  const double indirect = estimate.by_paths ? rest(estimate.likely, parts.visibility) : estimate.indirect;
  parts.reconstruction = std::min(parts.reconstruction, indirect);
  const double solution = rest(indirect, parts.reconstruction);
  parts.convergence = std::min(trust_in_pending * unshot, solution);
  parts.discretisation = rest(solution, parts.convergence);
  return parts;
}

ErrorKnobs first_knobs(double wanted, const ErrorKnobs& given, const ErrorLimits& limits) {
  MUST(wanted > 0);
  ErrorKnobs knobs = given;
  // What runs without a wish reaches .05 in most buildings: it is where to begin, with less for more and more for less.
  const double finer = 0.05 / wanted;
  if (limits.turns_elements)
    knobs.elements = static_cast<std::uint32_t>(std::clamp(12000 * std::pow(finer, finer < 1 ? 1.1 : 0.5), 1500.0,
                                                           static_cast<double>(limits.most_elements)));
  if (limits.turns_eps) knobs.eps = std::clamp(given.eps / finer, 1e-6, 1e-3);
  if (limits.turns_gather && !limits.begins_interpolated)
    knobs.gather_rays = static_cast<std::uint32_t>(
        std::clamp(192 * std::pow(finer, 1.4), 32.0, static_cast<double>(ErrorLimits::most_gather_rays)));
  if (limits.turns_direct) knobs.direct_rays = wanted > 0.05 ? 64 : 512;
  return knobs;
}

std::optional<ErrorKnobs> turned(const ErrorKnobs& now, const ErrorParts& parts, double wanted,
                                 const ErrorLimits& limits) {
  ErrorKnobs next = now;
  next.keep = 1;
  ErrorParts own = parts;
  const auto move_to_mesh = [&](double& part) {
    own.discretisation = std::hypot(own.discretisation, part);
    part = 0;
  };
  const double fair = std::sqrt(fair_share) * wanted;
  if (now.direct_is_solved()) {
    // Direct light, and what a gather at the point would make of the rest, are matters of receivers: they become smaller where it
    // is due, and if that was not enough, or shooters are to blame, all do.
    const double receivers = std::hypot(own.visibility, own.reconstruction), fair_for_both = std::numbers::sqrt2 * fair;
    const bool was_in_vain = now.keep < 1 && own.reconstruction > own.visibility;
    if (limits.turns_elements && receivers > fair_for_both && receivers > own.discretisation && !was_in_vain) {
      next.keep = std::clamp(std::pow(fair_for_both / receivers, 2), least_kept, most_kept);
      own.discretisation = own.reconstruction = own.visibility = 0;
    }
  }
  if (!now.is_gathered() && limits.turns_gather && own.reconstruction > fair) {
    next.gather_rays = first_gather;
    own.reconstruction = 0;
  } else if (!now.is_gathered()) {
    move_to_mesh(own.reconstruction);
  }
  if (now.direct_is_solved()) move_to_mesh(own.visibility);
  if (limits.turns_direct)
    next.direct_rays =
        further(now.direct_rays, turn_for(own.visibility, wanted, ray_law), ErrorLimits::most_direct_rays);
  if (limits.turns_gather && now.is_gathered())
    next.gather_rays =
        further(now.gather_rays, turn_for(own.reconstruction, wanted, ray_law), ErrorLimits::most_gather_rays);
  if (limits.turns_elements && next.keep == 1)
    next.elements =
        further(now.elements, turn_for(own.discretisation, wanted, now.is_gathered() ? seen_from_afar_law : mesh_law),
                limits.most_elements);
  if (limits.turns_eps) {
    const double more_shooters = static_cast<double>(next.elements) / now.elements;
    const double unshot = own.convergence * std::pow(more_shooters, unshot_law);
    // Smaller elements are worth nothing where light has not been shot that far: each of them has less of it to shoot.
    const double turn = std::max(more_shooters, turn_for(unshot, wanted, 1, fair_share_of_unshot));
    next.eps = std::max(now.eps / turn, ErrorLimits::least_eps);
  }
  ErrorKnobs as_before = now;
  as_before.keep = 1;
  if (next != as_before) return next;
  // Every part has its share, and together they are too much: the largest is turned.
  switch (own.dominant()) {
    case ErrorPart::visibility:
      if (limits.turns_direct) next.direct_rays = further(now.direct_rays, 2, ErrorLimits::most_direct_rays);
      break;
    case ErrorPart::reconstruction:
      if (limits.turns_gather && now.is_gathered())
        next.gather_rays = further(now.gather_rays, 2, ErrorLimits::most_gather_rays);
      break;
    case ErrorPart::discretisation:
      if (limits.turns_elements) next.elements = further(now.elements, 1.7, limits.most_elements);
      break;
    case ErrorPart::convergence:
      if (limits.turns_eps) next.eps = std::max(now.eps / 2, ErrorLimits::least_eps);
      break;
  }
  if (next == as_before) return std::nullopt;
  return next;
}

}  // namespace lichthof
