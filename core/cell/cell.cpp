#include "core/cell/cell.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/cell/box_cover.hpp"
#include "core/protocol/plausible_change.hpp"

namespace lichthof {

namespace {

constexpr std::size_t max_polls = 64;             // waves under way at once; the controller never has more than two
constexpr std::size_t message_header_bytes = 32;  // addresses, lengths and flags around shot and bitmap

double magnitude(const Rgb& power) { return std::abs(power.x) + std::abs(power.y) + std::abs(power.z); }

}  // namespace

Cell::Cell(CellId id, std::shared_ptr<const CellGrid> grid, std::unique_ptr<LightOfCell> light,
           const CellOptions& options)
    : id_(id), grid_(std::move(grid)), light_(std::move(light)), options_(options),
      join_(id, options.hemicube_resolution), queue_(options.waiting_limit) {
  MUST(grid_ && light_ && id_.value < grid_->cell_count());
  strongest_ = light_->strongest();
}

// ---- Filing -----------------------------------------------------------------------------------------------------------

void Cell::accept(const Envelope& envelope, Instant) {
  // Light comes from cells, orders come from the controller; anything else is not for us.
  const bool is_order = std::holds_alternative<ToController>(envelope.from);
  if (const auto* light = std::get_if<HemicubeMessage>(&envelope.message)) return accept(*light, envelope.from);
  if (!is_order) return refuse();
  if (const auto* start = std::get_if<StartRadiosity>(&envelope.message))
    accept(*start);
  else if (const auto* poll = std::get_if<PollCell>(&envelope.message))
    accept(*poll);
  else if (const auto* stop = std::get_if<StopRadiosity>(&envelope.message))
    accept(*stop);
  else if (const auto* change = std::get_if<GeometryChange>(&envelope.message))
    accept(*change);
  else
    refuse();
}

void Cell::accept(const HemicubeMessage& message, const Address& from) {
  ++state_.received;
  const auto* sender = std::get_if<CellId>(&from);
  const BitmapJoin::Filed filed =
      sender && *sender == message.from ? join_.file(*grid_, message) : BitmapJoin::Filed::refused;
  if (filed == BitmapJoin::Filed::refused) {
    ++state_.processed;  // it was sent, so it has to count: else the run could never end
    return refuse(sender && *sender == message.from ? join_.fault() : ShotFault{});
  }
  if (filed == BitmapJoin::Filed::waiting) return;
  ExternalShot shot = join_.take();
  state_.most_joined = std::max(state_.most_joined, shot.parts);
  queue_.push(std::move(shot));
  reported_idle_ = false;
}

void Cell::accept(const StartRadiosity& message) {
  if (message.epoch != options_.epoch) return;
  if (std::isnan(message.threshold_w) || message.threshold_w < 0) return refuse();
  threshold_w_ = message.threshold_w;
  running_ = true;
  reported_idle_ = false;
}

void Cell::accept(const PollCell& message) {
  if (message.epoch != options_.epoch) return;
  if (polls_.size() >= max_polls) return refuse();
  polls_.push_back(message.wave);
}

void Cell::accept(const StopRadiosity& message) {
  if (message.epoch == options_.epoch) running_ = false;
}

void Cell::accept(const GeometryChange& message) {
  if (!geometry_.file(message)) return refuse();
  reported_idle_ = false;
}

void Cell::refuse(const ShotFault& fault) {
  last_fault_ = fault;
  ++state_.refused;
  ++newly_refused_;
  reported_idle_ = false;
}

// ---- Working ----------------------------------------------------------------------------------------------------------

bool Cell::idle() const { return !running_ || (!geometry_.has_next() && next_shooter(false) == NextShooter::none); }

bool Cell::has_work() const {
  return !announced_ || !polls_.empty() || newly_refused_ > 0 ||
         (running_ &&
          (geometry_.has_next() || next_shooter(held_) != NextShooter::none || (idle() && !reported_idle_)));
}

Effects Cell::step(Instant) {
  MUST(has_work());
  Effects effects;
  for (; newly_refused_ > 0; --newly_refused_) effects.events.push_back(MessageRefused{id_, last_fault_});
  if (!announced_) {
    announced_ = true;
    effects.outbox.push_back({id_, ToController{}, CellReady{id_, light_->largest_initial_power()}});
  }
  if (running_) {
    // A change first, so that no shot is taken with values that are out of date; else the stronger shooter.
    if (geometry_.has_next()) {
      apply_change(effects);
    } else if (const NextShooter next = next_shooter(held_); next == NextShooter::external) {
      receive_external(effects);
    } else if (next == NextShooter::local) {
      shoot_locally(effects);
    }
  }
  report_where_asked(effects);
  return effects;
}

void Cell::apply_change(Effects& effects) {
  const GeometryChange& change = geometry_.take_next();
  if (!plausible(change)) {
    ++state_.refused;  // the version counts all the same, or every later shot would wait for it
    effects.events.push_back(MessageRefused{id_});
    return;
  }
  if (const auto* emission = std::get_if<SetEmission>(&change.change))
    light_->set_emission(emission->material, emission->radiance);
  else if (const auto* reflectance = std::get_if<SetReflectance>(&change.change))
    light_->set_reflectance(reflectance->material, reflectance->reflectance);
  strongest_ = light_->strongest();
  effects.events.push_back(ChangeApplied{change.version, id_});
}

void Cell::shoot_locally(Effects& effects) {
  // Transfer into the own subscene.
  const ShotId id{id_, next_sequence_++};
  const auto shot = std::make_shared<const Shot>(light_->take_shot(strongest_.group, id, geometry_.version()));
  const TransferWork work = light_->receive(*shot, nullptr);
  strongest_ = light_->strongest();
  ++state_.local_shots;
  ++counters_.shots;
  count(work, effects);
  effects.events.push_back(ShotFired{id, magnitude(shot->power()), false, id_, sum_channels(work.received)});

  // On to the cells around, through what this cell lets pass.
  if (grid_->cell_count() == 1) return;
  send_on(shot, pose_of(*grid_, *shot), HemicubeBitmap(options_.hemicube_resolution), effects);
}

void Cell::receive_external(Effects& effects) {
  ExternalShot external = queue_.pop_external(geometry_.version());
  const Shot& shot = *external.shot;
  const ShooterPose pose = pose_of(*grid_, shot);
  ++state_.external_shots;
  state_.processed += external.parts;
  if (external.parts > 1) effects.events.push_back(BitmapsJoined{shot.id, id_, external.parts});

  // Nothing gets in where every pixel towards the cell is covered; then nothing in it can cover more either.
  const bool is_covered = external.closed || hides(external.bitmap, shot.frame(), grid_->box(id_));
  if (is_covered) {
    ++counters_.cells_skipped;
    effects.events.push_back(VisitSkipped{shot.id, id_});
  } else {
    const TransferWork work = light_->receive(shot, &external.bitmap);
    strongest_ = light_->strongest();
    count(work, effects);
    effects.events.push_back(ShotFired{shot.id, external.power_w, true, id_, sum_channels(work.received)});
  }
  if (external.closed)
    send_closed(external.shot, pose, effects);
  else
    send_on(external.shot, pose, external.bitmap, effects);
}

// ---- Sending ----------------------------------------------------------------------------------------------------------

void Cell::send_on(const std::shared_ptr<const Shot>& shot, const ShooterPose& pose, const HemicubeBitmap& bitmap,
                   Effects& effects) {
  const CellList next = successors(*grid_, pose, id_);
  if (next.empty()) return;
  const HemicubeFrame frame = shot->frame();
  // Projection is only worth it while some pixel towards a successor is free.
  std::vector<NextCell> open;
  std::vector<bool> is_open;
  for (const CellId successor : next) {
    const NextCell cell{grid_->box(successor), reach(*grid_, pose, successor)};
    is_open.push_back(!hides(bitmap, frame, cell.reach));
    if (is_open.back()) open.push_back(cell);
  }
  std::vector<Passage> passed;
  if (!open.empty()) {
    passed = light_->project(*shot, open, bitmap);
    ++effects.work.bitmaps_projected;
  }
  std::vector<std::uint8_t> bytes;  // of the last that was packed
  const HemicubeBitmap* is_packed = nullptr;
  for (std::size_t k = 0, o = 0; k < next.size(); ++k) {
    bool closed = !is_open[k];
    if (!closed) {
      const auto& [bits, walled] = passed[o];
      closed = hides(walled.resolution() > 0 ? walled : bits, frame, open[o++].reach);
      if (!closed && !(is_packed && *is_packed == bits)) bytes = packed(bits), is_packed = &bits;
    }
    send({shot, id_, closed, closed ? std::vector<std::uint8_t>() : bytes}, next[k], effects);
  }
}

void Cell::send_closed(const std::shared_ptr<const Shot>& shot, const ShooterPose& pose, Effects& effects) {
  for (const CellId successor : successors(*grid_, pose, id_)) send({shot, id_, true, {}}, successor, effects);
}

void Cell::send(HemicubeMessage message, CellId to, Effects& effects) {
  const std::size_t bytes = message_header_bytes + message.shot->wire_bytes() + message.bitmap.size();
  ++state_.sent;
  ++counters_.messages;
  counters_.bytes_sent += bytes;
  effects.work.bytes_sent += bytes;
  if (!message.closed) {
    counters_.bitmap_bytes += message.bitmap.size();
    counters_.bitmap_bytes_raw += pixel_count(options_.hemicube_resolution) / 8;
  }
  effects.outbox.push_back({id_, to, std::move(message)});
}

void Cell::count(const TransferWork& work, Effects& effects) {
  counters_.rays += work.rays;
  counters_.rays_saved += work.rays_saved;
  counters_.rays_remembered += work.rays_remembered;
  counters_.form_factors += work.form_factors;
  counters_.clusters_tested += work.clusters_tested;
  counters_.clusters_behind += work.clusters_behind;
  counters_.clusters_hidden += work.clusters_hidden;
  counters_.clusters_cut += work.clusters_cut;
  effects.work.rays += work.rays - work.rays_saved;
  effects.work.form_factors += work.form_factors;
  effects.work.clusters_tested += work.clusters_tested;
}

// ---- Reporting --------------------------------------------------------------------------------------------------------

CellReport Cell::report(std::uint64_t wave) const {
  const CellPower power = light_->power();
  CellReport report;
  report.cell = id_;
  report.epoch = options_.epoch;
  report.wave = wave;
  report.idle = idle();
  report.messages_sent = state_.sent;
  report.messages_processed = state_.processed;
  report.shots = state_.local_shots;
  report.strongest_w = std::max(strongest_.power_w, queue_.strongest_external(geometry_.version()));
  report.unshot_w = power.unshot;
  report.emitted_w = power.emitted;
  return report;
}

void Cell::report_where_asked(Effects& effects) {
  for (const std::uint64_t wave : polls_) effects.outbox.push_back({id_, ToController{}, report(wave)});
  polls_.clear();
  if (!running_ || !idle() || reported_idle_) return;
  reported_idle_ = true;
  effects.outbox.push_back({id_, ToController{}, report(0)});
  effects.events.push_back(CellIdle{id_});
}

Cell::State Cell::state() const {
  State state = state_;
  state.waiting_parts = join_.waiting_parts();
  state.queued_parts = queue_.parts();
  return state;
}

}  // namespace lichthof
