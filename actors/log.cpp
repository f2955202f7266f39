#include "actors/log.hpp"

#include <spdlog/spdlog.h>

#include <exception>

namespace lichthof::actors {

namespace {

template <class... F>
struct Cases : F... {
  using F::operator()...;
};

std::string text(const ShotId& shot) { return fmt::format("shot {}.{}", shot.cell.value, shot.sequence); }

}  // namespace

std::string text(const Address& address) {
  return std::visit(
      Cases{[](ToController) { return std::string("controller"); }, [](ToBalancer) { return std::string("balancer"); },
            [](CellId cell) { return fmt::format("cell {}", cell.value); },
            [](WorkerId worker) { return fmt::format("worker {}", worker.value); }},
      address);
}

std::string text(const Event& event) {
  return std::visit(
      Cases{[](const ShotFired& e) {
              return fmt::format("cell {} {} {}: {:.4g} W, {:.4g} W arrive", e.cell.value,
                                 e.external ? "receives" : "fires", text(e.shot), e.power_w, e.received_w);
            },
            [](const BitmapsJoined& e) {
              return fmt::format("cell {} joins {} bitmaps of {}", e.cell.value, e.parts, text(e.shot));
            },
            [](const VisitSkipped& e) { return fmt::format("cell {} sees nothing of {}", e.cell.value, text(e.shot)); },
            [](const ChangeApplied& e) {
              return fmt::format("cell {} applies change {}", e.cell.value, e.version.value);
            },
            [](const CellIdle& e) { return fmt::format("cell {} falls idle", e.cell.value); },
            [](const Converged& e) { return fmt::format("converged after {} shots", e.shots); },
            [](const JobAssigned& e) {
              return fmt::format("worker {} gets columns {} to {}", e.worker.value, e.first, e.last);
            },
            [](const JobFinished& e) {
              return fmt::format("worker {} delivers columns {} to {}", e.worker.value, e.first, e.last);
            },
            [](const MessageRefused& e) {
              const ShotFault& fault = e.fault;
              if (!fault.what) return fmt::format("cell {}: a message was refused", e.cell.value);
              const std::string place =
                  fault.patch == ShotFault::whole ? "" : fmt::format(", in its patch {}", fault.patch);
              return fmt::format("cell {}: a shot of group {} in cell {} was refused: it has {}{}", e.cell.value,
                                 fault.group.value, fault.shot.cell.value, fault.what, place);
            }},
      event);
}

std::string text(const caf::error& error) {
  if (error.context().match_elements<std::string>()) return error.context().get_as<std::string>(0);
  if (error.category() == caf::atom("exit")) return to_string(static_cast<caf::exit_reason>(error.code()));
  return to_string(error);
}

void log_events(const std::vector<Event>& events) {
  const bool in_detail = spdlog::should_log(spdlog::level::debug);
  for (const Event& event : events) {
    if (std::holds_alternative<MessageRefused>(event))
      spdlog::warn(text(event));
    else if (in_detail)
      spdlog::debug(text(event));
  }
}

void log_undeliverable(const Address& to) { spdlog::error("no way to {}: a message is lost", text(to)); }

caf::error failure_of(const std::string& who, const std::exception_ptr& exception) {
  std::string what = "unknown exception";
  try {
    std::rethrow_exception(exception);
  } catch (const std::exception& e) {
    what = e.what();
  } catch (...) {
  }
  spdlog::error("{}: {}", who, what);
  return caf::make_error(caf::sec::runtime_error, who + ": " + what);
}

void log_unexpected(const std::string& who, const caf::message_view& message) {
  spdlog::warn("{}: unexpected message {}", who, message.content().stringify());
}

void log_error(const std::string& who, const caf::error& error) { spdlog::error("{}: {}", who, text(error)); }

}  // namespace lichthof::actors
