#include "apps/accuracy.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace lichthof::apps {

namespace {

constexpr std::uint32_t default_gather = 192, default_elements = 12000;
/// All points of most lists, and as many of longer ones; over surfaces that all count alike, as many tell 2 % from 3 %.
constexpr std::uint32_t check_points = 256;
constexpr int most_rounds = 5;
/// Elements where a search ends, at an error of .05; in inverse proportion to smaller ones.
constexpr double most_elements_at_5_percent = 1e5;
/// A round ends the search when all that 95 % confidence leaves is below what is wanted; or when the estimate is below this share
/// of it, and the check can do no better.
constexpr double safe_share = 0.75;
/// An error of this size is all there is: what is wanted is reached within what the check can tell.
constexpr double least_error = 1e-4;
/// A search that has not come nearer than this share in a round, twice, is stuck.
constexpr double progress = 0.85;
constexpr double eps_where_stuck = 16;
/// Rays of a check at an error of .05, and how they grow with a smaller one: about what the default first pass costs in a room.
constexpr double check_rays = 1.5e6, check_law = 1.5;
/// Where the check can't tell whether the error is reached, it may look so many times longer, once.
constexpr std::uint64_t longer_look = 4;

ErrorKnobs knobs_by_hand(const Run& run, const Question& question) {
  const auto [reading, gather_rays] = std::pair(question.reading, question.gather_rays);
  ErrorKnobs knobs;
  knobs.elements = run.first_pass().elements.value_or(default_elements);
  knobs.eps = run.first_pass().eps.value_or(knobs.eps);
  if (reading == Reading::as_it_is || run.method() == Method::radiosity) knobs.direct_rays = 0;
  knobs.gather_rays = reading == Reading::at_sensors && knobs.direct_rays > 0 ? gather_rays.value_or(default_gather)
                                                                              : gather_rays.value_or(0);
  knobs.counts_gather = gather_rays.has_value();
  return knobs;
}

ErrorLimits limits_of(const Run& run, const ErrorKnobs& knobs, const Question& question) {
  ErrorLimits limits;
  const bool is_loaded = run.solution().has_value();
  limits.turns_elements = !is_loaded && run.first_pass().mesh_given().empty();
  limits.turns_eps = !is_loaded && !run.first_pass().eps;
  limits.turns_direct = !knobs.direct_is_solved();
  limits.turns_gather = limits.turns_direct && !question.gather_rays;
  limits.begins_interpolated = question.reading == Reading::in_picture;
  return limits;
}

nlohmann::json parts_json(const ErrorParts& parts) {
  return {{"visibility", parts.visibility},
          {"reconstruction", parts.reconstruction},
          {"discretisation", parts.discretisation},
          {"convergence", parts.convergence},
          {"dominant", name_of(parts.dominant())}};
}

nlohmann::json round_json(const ErrorKnobs& knobs, std::size_t elements, const ErrorEstimate& estimate,
                          const ErrorParts& parts, double seconds) {
  return {{"elements", elements},        {"eps", knobs.eps},
          {"gather", knobs.gather_rays}, {"direct_rays", knobs.direct_rays},
          {"estimate", estimate.error},  {"parts", parts_json(parts)},
          {"seconds", seconds}};
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g %%", 100 * share);
  return text;
}

std::string in_words(const ErrorEstimate& estimate, const ErrorParts& parts) {
  return "error " + percent(estimate.error) + " (95 %: " + percent(estimate.low) + " to " + percent(estimate.high) +
         "), bias " + percent(estimate.bias) + "; visibility " + percent(parts.visibility) + ", reconstruction " +
         percent(parts.reconstruction) + ", discretisation " + percent(parts.discretisation) + ", convergence " +
         percent(parts.convergence);
}

/// One search from a wish to the knobs that meet it, or to the reason why none do.
class Search {
 public:
  Search(Run& run, const ErrorWish& wish, const Question& question, const Interruption& interruption)
      : run_(run), wish_(wish), question_(question), interruption_(interruption), wanted_(wish.error.value_or(0)),
        is_solved_(run.solution().has_value()), knobs_(knobs_by_hand(run, question)),
        limits_(limits_of(run, knobs_, question)) {
    if (!wish.error) return;
    limits_.most_elements = static_cast<std::uint32_t>(std::clamp(
        most_elements_at_5_percent * 0.05 / wanted_, 24000.0, static_cast<double>(limits_.most_elements)));
    knobs_.counts_gather = true;
    knobs_ = first_knobs(wanted_, knobs_, limits_);
    if (!is_solved_) run.choose(limits_.turns_elements ? std::optional(knobs_.elements) : std::nullopt, knobs_.eps);
  }

  Status solve() {
    if (is_solved_) return Done{};
    // A finer mesh wants to be refined where the one before had to be.
    if (is_new_mesh_ && refined_to_ < 1) run_.refine(refined_to_);
    if (Status solved = run_.solve(); !solved) return solved;
    is_solved_ = true;
    return Done{};
  }

  /// @returns false: the search is over
  bool go_on(int round) {
    const Stopwatch watch;
    const Run::Checked checked = look(static_cast<std::uint64_t>(round));
    estimate_ = checked.estimate;
    parts_ = parts_of(estimate_, checked.unshot, checked.noise);
    rounds_.push_back(
        round_json(knobs_, run_.solution()->mesh->elements.size(), estimate_, parts_, watch.seconds()));
    spdlog::info("round {}: {}{}", round, in_words(estimate_, parts_),
                 estimate_.by_paths ? "; paths have found what the walks missed" : "");
    if (!wish_.error || is_met() || interruption_.asked()) return false;
    stuck_ = estimate_.error > progress * nearest_ ? stuck_ + 1 : 0;
    nearest_ = std::min(nearest_, estimate_.error);
    const std::optional<ErrorKnobs> next = turned(knobs_, parts_, wanted_, limits_);
    if (!next)
      reason_ = std::string("what is left is ") + name_of(parts_.dominant()) + ", and nothing more can be turned";
    else if (stuck_ >= 2)
      reason_ = std::string("two rounds have brought little; what is left is ") + name_of(parts_.dominant());
    else if (round == most_rounds)
      reason_ = "after " + std::to_string(most_rounds) + " rounds";
    if (!reason_.empty()) return false;
    turn(*next);
    run_.say_before("round " + std::to_string(round + 1) + ", error so far " + percent(estimate_.error) + ": ");
    return true;
  }

  void report() {
    nlohmann::json report = {{"estimate", estimate_.error},    {"low", estimate_.low},     {"high", estimate_.high},
                             {"bias", estimate_.bias},         {"noise", estimate_.noise}, {"points", estimate_.points},
                             {"parts", parts_json(parts_)},    {"rounds", rounds_},
                             {"by_paths", estimate_.by_paths}};
    if (wish_.error) {
      report["wanted"] = wanted_, report["met"] = is_met();
      if (!is_met()) {
        if (estimate_.low < wanted_) reason_ += ", and the check can't exclude more";
        report["reason"] = reason_;
        spdlog::warn("an error of {} was asked for, {} is reached: {}", percent(wanted_), percent(estimate_.error),
                     reason_);
      }
    }
    run_.record().more["error"] = std::move(report);
    run_.record().more["error_estimate"] = estimate_.error;
    run_.record().lines.push_back(in_words(estimate_, parts_));
  }

  const ErrorKnobs& knobs() {
    knobs_.eps = run_.solution()->options.eps;
    return knobs_;
  }

 private:
  bool is_met() const {
    return !wish_.error || estimate_.high <= std::max(wanted_, least_error) || estimate_.error <= safe_share * wanted_;
  }

  Run::Checked look(std::uint64_t seed) {
    const LitScenePtr scene = run_.lit_scene();
    const CheckPoints places = question_.places(*scene, check_points, seed);
    ErrorCheckOptions effort;
    effort.wanted = wanted_, effort.least = std::max(effort.least, 0.25 * wanted_), effort.seed = seed;
    effort.most_rays =
        static_cast<std::uint64_t>(check_rays * std::pow(0.05 / (wish_.error ? wanted_ : 0.02), check_law));
    Run::Checked checked = run_.check(scene, places, knobs_, effort);
    const bool is_open = checked.estimate.low < wanted_ && checked.estimate.high > wanted_ &&
                         checked.estimate.noise > 0.5 * checked.estimate.error;
    if (!wish_.error || !is_open || checked.estimate.error <= safe_share * wanted_) return checked;
    effort.most_rays *= longer_look;
    return run_.check(scene, places, knobs_, effort);
  }

  void turn(const ErrorKnobs& next) {
    const ErrorKnobs before = std::exchange(knobs_, next);
    // What elements have not mended may be light that has not been shot to where it counts.
    if (stuck_ > 0 && limits_.turns_eps) knobs_.eps = std::max(before.eps / eps_where_stuck, ErrorLimits::least_eps);
    const bool is_refined = knobs_.keep < 1 && run_.refine(knobs_.keep);
    // Little can be done in places: all elements become smaller.
    if (knobs_.keep < 1 && !is_refined) knobs_.elements = std::min(2 * knobs_.elements, limits_.most_elements);
    if (is_refined) refined_to_ = knobs_.keep;
    is_new_mesh_ = knobs_.elements != before.elements;
    const bool is_new_end = knobs_.eps != before.eps;
    if (is_new_mesh_ || is_new_end)
      run_.choose(is_new_mesh_ ? std::optional(knobs_.elements) : std::nullopt, knobs_.eps);
    is_solved_ = !is_refined && !is_new_mesh_ && !is_new_end;
  }

  Run& run_;
  const ErrorWish& wish_;
  const Question& question_;
  const Interruption& interruption_;
  double wanted_;
  bool is_solved_, is_new_mesh_ = true;
  ErrorKnobs knobs_;
  ErrorLimits limits_;
  double refined_to_ = 1, nearest_ = 1e300;
  int stuck_ = 0;
  ErrorEstimate estimate_;
  ErrorParts parts_;
  nlohmann::json rounds_ = nlohmann::json::array();
  std::string reason_;
};

}  // namespace

void add_error_options(CLI::App& command, ErrorWish& wish, const std::string& of) {
  command
      .add_option("--error", wish.error,
                  "work until the relative RMS error of " + of + " is below this; chooses what is not set by hand")
      ->check(number_within(1e-4, 1))
      ->group("Accuracy")
      ->option_text("SHARE");
  command.add_flag("--check", wish.check, "estimate the error that is reached")->group("Accuracy");
  command.add_flag("--strict", wish.strict, "exit with 1 where --error was not reached; the result is written all the same")
      ->group("Accuracy");
}

Status wish_fits(const ErrorWish& wish, const Run& run) {
  if (!wish.is_set() || has_first_pass(run.method())) return Done{};
  return Error{ErrorCode::bad_input, wish.error ? "--error" : "--check",
               std::string("method ") + name_of(run.method()) + " has no first pass whose error could be told; " +
                   (run.method() == Method::reference ? "its standard error is in the --json report of probe"
                                                      : "methods two-pass and radiosity have")};
}

Expected<ErrorKnobs> reach(Run& run, const ErrorWish& wish, const Question& question, const Interruption& interruption) {
  Search search(run, wish, question, interruption);
  for (int round = 1;; ++round) {
    if (Status solved = search.solve(); !solved) return solved.error();
    if (interruption.asked() || !wish.is_set()) break;
    if (search.go_on(round)) continue;
    search.report();
    break;
  }
  run.say_before({});
  run.warn_of_ledger();
  return search.knobs();
}

Status strictly(const ErrorWish& wish, Run& run) {
  const nlohmann::json& more = run.record().more;
  if (!wish.strict || !wish.error || !more.contains("error") || more["error"]["met"] == true) return Done{};
  return Error{ErrorCode::failed, "", "the error that was asked for is not reached (--strict)"};
}

}  // namespace lichthof::apps
