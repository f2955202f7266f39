#include "actors/cluster/hosted_run.hpp"

#include <algorithm>
#include <set>

#include "actors/worker_actor.hpp"
#include "core/cell/routing.hpp"
#include "core/light/cell_values.hpp"

namespace lichthof::actors {

namespace {

constexpr std::uint32_t columns_per_step = 1;  // a worker can be stopped after each

// ---- Actors that stand for machines elsewhere -------------------------------------------------------------------------

using SendFrom = std::function<void(const Address&, const Message&)>;

HemicubeSink::behavior_type cell_elsewhere(HemicubeSink::pointer, SendFrom send) {
  return {[send = std::move(send)](const HemicubeMessage& message) { send(message.from, message); }};
}

ReportSink::behavior_type controller_elsewhere(ReportSink::pointer, SendFrom send) {
  return {[send](const CellReady& message) { send(message.cell, message); },
          [send](const CellReport& message) { send(message.cell, message); }};
}

JobSource::behavior_type balancer_elsewhere(JobSource::pointer, SendFrom send) {
  return {[](const Enlistment&) {}, [send](const JobRequest& message) { send(message.worker, message); },
          [send](const ColumnResult& message) { send(message.worker, message); }};
}

bool is_begun(const Solution& s) {
  const auto holds_light = [](const std::vector<Rgbf>& values) {
    return std::any_of(values.begin(), values.end(), [](const Rgbf& value) { return value != Rgbf{0.f}; });
  };
  return holds_light(s.shot) || holds_light(s.irradiance);
}

Error impossible(const std::string& what) { return {ErrorCode::bad_input, "run", what}; }

}  // namespace

Expected<std::shared_ptr<HostedRun>> HostedRun::make(const HostShare& share, NodeId own,
                                                     std::shared_ptr<const Solution> solution, unsigned threads) {
  std::shared_ptr<HostedRun> run(new HostedRun(share, std::move(solution)));
  const Status made = share.pass == Pass::radiosity ? run->make_cells(own, threads) : run->make_source();
  if (!made) return made.error();
  return run;
}

HostedRun::~HostedRun() {
  if (company_) company_->dismiss();
}

Status HostedRun::make_cells(NodeId own, unsigned threads) {
  const Solution& s = *solution_;
  CellsWanted wanted;
  wanted.along = s.options.cells;
  Expected<CellGrid> grid = partition(*s.mesh, bounds(*s.scene), wanted);
  if (!grid) return grid.error();
  grid_ = std::make_shared<const CellGrid>(std::move(*grid));
  if (share_.cells.size() != grid_->cell_count()) return impossible("has other cells than its solution");
  groups_ = groups_by_cell(*s.mesh, *grid_);

  const auto parallel = std::make_shared<const Parallel>(threads);
  TransferOptions transfer;
  transfer.method = s.options.method;
  transfer.hemicube_resolution = s.options.hemicube_resolution;
  CellOptions options;
  options.hemicube_resolution = s.options.hemicube_resolution;
  options.epoch = share_.epoch;
  const bool is_divided = grid_->cell_count() > 1;
  const auto exchange = std::make_shared<const GroupExchange>(*s.scene, *s.mesh, *parallel);
  std::set<NodeId> partners;
  for (CellId cell{0}; cell.value < grid_->cell_count(); ++cell.value) {
    if (share_.cells[cell.value] != own) continue;
    auto hosted = std::make_unique<HostedCell>();
    // A cell that is alone has no boundary to clip to.
    const Box box = is_divided ? grid_->box(cell) : Box{Vec3{-1e300}, Vec3{1e300}};
    hosted->light = std::make_shared<CellLight>(s.scene, s.mesh, groups_[cell.value], box, transfer, parallel, exchange);
    if (is_begun(s)) hosted->light->load(s);
    hosted->machine = std::make_shared<Cell>(cell, grid_, std::make_unique<RealLight>(hosted->light), options);
    cells_.emplace(cell, std::move(hosted));
    const CellPosition here = grid_->position(cell);
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        if ((step < 0 && here[axis] == 0) || (step > 0 && here[axis] + 1 == grid_->size()[axis])) continue;
        CellPosition there = here;
        there[axis] += static_cast<std::uint32_t>(step);
        if (const NodeId node = share_.cells[grid_->at(there).value]; node != own) partners.insert(node);
      }
  }
  if (cells_.empty()) return impossible("has no cell for this node");
  partners_.assign(partners.begin(), partners.end());
  return Done{};
}

Status HostedRun::make_source() {
  const PictureSpec& spec = share_.picture;
  const bool is_plausible = spec.camera.size() == 10 && spec.width >= 1 && spec.height >= 1 && spec.width <= 65536 &&
                            spec.height <= 65536 && spec.samples >= 1 && share_.workers >= 1 &&
                            share_.workers <= 4096 && (spec.method <= 2 || spec.method == 255);
  if (!is_plausible) return impossible("has a picture that can not be");
  const std::vector<double>& c = spec.camera;
  const Expected<Camera> camera = checked(Camera{"", {c[0], c[1], c[2]}, {c[3], c[4], c[5]}, {c[6], c[7], c[8]}, c[9]});
  if (!camera) return camera.error();
  PictureWish wish;
  wish.path_tracing = spec.method == 255;
  if (!wish.path_tracing) wish.method = static_cast<TracingMethod>(spec.method);
  wish.camera = *camera;
  wish.width = spec.width, wish.height = spec.height;
  wish.samples = spec.samples, wish.gather_rays = spec.gather_rays;
  // Methods without a first pass take their ambient light from the scene alone.
  const bool is_lit = is_begun(*solution_);
  source_ = picture_source(
      is_lit ? std::make_shared<const LitScene>(*solution_) : std::make_shared<const LitScene>(solution_->scene), wish);
  return Done{};
}

void HostedRun::start(caf::actor_system& system, Send send) {
  send_ = std::move(send);
  company_ = std::make_unique<Company>(system);
  if (share_.pass == Pass::radiosity)
    start_cells(system);
  else
    start_workers(system);
}

void HostedRun::start_cells(caf::actor_system& system) {
  std::vector<HemicubeSink> sinks(grid_->cell_count());
  for (auto& [id, hosted] : cells_) {
    HostedCell* const cell = hosted.get();
    traffic_[id];
    look(*cell->machine, false, *cell);
    RunContext context{Clock(), nullptr, meters_, hold_, [cell](const Cell& machine) {
                         const Cell::State state = machine.state();
                         // What waits for its predecessors is none of the senders' fault: it counts as done.
                         cell->processed = state.processed + state.waiting_parts;
                         cell->shots = state.local_shots;
                         cell->rays = machine.counters().rays;
                       }};
    cell->actor = company_->join(system.spawn<caf::lazy_init>(cell_actor, cell->machine, context));
    sinks[id.value] = caf::actor_cast<HemicubeSink>(cell->actor);
  }
  for (CellId cell{0}; cell.value < grid_->cell_count(); ++cell.value)
    if (!sinks[cell.value])
      sinks[cell.value] = company_->join(system.spawn(
          cell_elsewhere,
          SendFrom([this, cell](const Address& from, const Message& message) { send(from, cell, message); })));
  Introduction introduction;
  introduction.controller = company_->join(system.spawn(
      controller_elsewhere,
      SendFrom([this](const Address& from, const Message& message) { send(from, ToController{}, message); })));
  introduction.cells = std::make_shared<const std::vector<HemicubeSink>>(std::move(sinks));
  for (const auto& [id, hosted] : cells_) caf::anon_send(hosted->actor, introduction);
}

void HostedRun::start_workers(caf::actor_system& system) {
  for (std::uint32_t k = 0; k < share_.workers; ++k) traffic_[WorkerId{share_.first_worker + k}];
  const JobSource balancer = company_->join(system.spawn(
      balancer_elsewhere,
      SendFrom([this](const Address& from, const Message& message) { send(from, ToBalancer{}, message); })));
  const Clock clock;
  for (std::uint32_t k = 0; k < share_.workers; ++k) {
    const WorkerId id{share_.first_worker + k};
    const auto worker = std::make_shared<Worker>(id, source_, columns_per_step);
    workers_[id] = caf::actor_cast<JobSink>(
        company_->join(system.spawn<caf::detached>(worker_actor, id, worker, balancer, clock, meters_)));
  }
}

std::vector<caf::actor> HostedRun::actors() const {
  std::vector<caf::actor> all;
  for (const auto& [id, hosted] : cells_) all.push_back(caf::actor_cast<caf::actor>(hosted->actor));
  for (const auto& [id, sink] : workers_) all.push_back(caf::actor_cast<caf::actor>(sink));
  return all;
}

void HostedRun::send(const Address& from, const Address& to, const Message& message) {
  const std::size_t bytes = send_(to, message);
  if (const auto found = traffic_.find(from); found != traffic_.end()) found->second.bytes_out += bytes;
}

bool HostedRun::deliver(const RunMessage& message, Message content, std::size_t frame_bytes) {
  const Address to = address(message);
  if (const auto found = traffic_.find(to); found != traffic_.end()) found->second.bytes_in += frame_bytes;
  if (const auto* id = std::get_if<CellId>(&to)) {
    const auto found = cells_.find(*id);
    if (found == cells_.end()) return false;
    const CellActor& cell = found->second->actor;
    return std::visit(
        [&]<class M>(M& one) {
          if constexpr (is_one_of<M, std::variant<HemicubeMessage, StartRadiosity, PollCell, StopRadiosity,
                                                  GeometryChange>>) {
            caf::anon_send(cell, std::move(one));
            return true;
          }
          return false;
        },
        content);
  }
  const auto* worker = std::get_if<WorkerId>(&to);
  const auto* assignment = std::get_if<JobAssignment>(&content);
  if (!worker || !assignment) return false;
  const auto found = workers_.find(*worker);
  if (found == workers_.end()) return false;
  caf::anon_send(found->second, *assignment);
  return true;
}

CellImage HostedRun::image(const Cell& cell) const {
  const CellLight& light = *cells_.at(cell.id())->light;
  Solution all;
  all.mesh = solution_->mesh;
  for (auto* values : {&all.irradiance, &all.direct_irradiance, &all.shot, &all.pending})
    values->assign(all.mesh->elements.size(), Rgbf{0.f});
  light.store(all);
  return {share_.job,      share_.epoch,  cell.id(),      cell_values(all, groups_[cell.id().value]),
          light.power(), cell.counters()};
}

void HostedRun::collect(const std::function<void(CellImage)>& take) const {
  for (const auto& [id, hosted] : cells_)
    caf::anon_send(hosted->actor, Look{[this, take](const Cell& cell) { take(image(cell)); }});
}

void HostedRun::hold(bool is_held) {
  if (hold_->exchange(is_held) == is_held || is_held) return;
  for (const auto& [id, hosted] : cells_) caf::anon_send(hosted->actor, wake_atom_v);
}

std::uint64_t HostedRun::processed(CellId cell) const {
  const auto found = cells_.find(cell);
  return found == cells_.end() ? 0 : found->second->processed.load();
}

HostedRun::Worked HostedRun::worked() const {
  Worked sum;
  for (const auto& meter : meters_->all()) sum.busy_ns += meter->busy_ns, sum.cpu_ns += meter->cpu_ns;
  for (const auto& [id, hosted] : cells_) sum.shots += hosted->shots, sum.rays += hosted->rays;
  return sum;
}

// ---- Load ------------------------------------------------------------------------------------------------------------

void HostedRun::look(const Cell& machine, bool is_held, HostedCell& cell) {
  cell.state = !machine.running() ? "resting" : machine.idle() ? "idle" : is_held ? "held" : "shooting";
  cell.memory_bytes = machine.memory_bytes();
  cell.unshot_w = sum_channels(machine.light().power().unshot);
}

/// On the cell's own thread, between two steps: nobody else may look at a machine at work.
void HostedRun::ask_for_load(HostedCell& cell) {
  if (cell.is_asked.exchange(true)) return;  // it is in the midst of a long step
  caf::anon_send(cell.actor, Look{[&cell, hold = hold_](const Cell& machine) {
                   look(machine, *hold, cell);
                   cell.is_asked = false;
                 }});
}

std::vector<ActorLoad> HostedRun::load() {
  std::vector<ActorLoad> all;
  const std::size_t shared_bytes = source_ && !workers_.empty() ? source_->memory_bytes() / workers_.size() : 0;
  std::map<std::string, Address> machines;
  for (const auto& [address, traffic] : traffic_) machines.emplace(text(address), address);
  for (const auto& meter : meters_->all()) {
    const Address& machine = machines.at(meter->name);
    const Traffic& traffic = traffic_.at(machine);
    ActorLoad& load = all.emplace_back();
    load.name = meter->name, load.job = share_.job;
    load.busy_ns = meter->busy_ns_now(), load.mailbox = meter->depth;
    load.bytes_in = traffic.bytes_in, load.bytes_out = traffic.bytes_out;
    if (const auto* id = std::get_if<CellId>(&machine)) {
      HostedCell& cell = *cells_.at(*id);
      load.state = cell.state.load(), load.shots = cell.shots, load.rays = cell.rays;
      load.memory_bytes = cell.memory_bytes, load.unshot_w = cell.unshot_w;
      ask_for_load(cell);
    } else {
      load.state = meter->since_ns != 0 ? "tracing" : "waiting";
      load.rays = meter->rays, load.memory_bytes = shared_bytes;
    }
  }
  return all;
}

}  // namespace lichthof::actors
