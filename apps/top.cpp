/// `lichthof top`: who does how much in a cluster just now, as a screen that renews itself, or as lines.
#include <ncurses.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <clocale>
#include <memory>
#include <string>
#include <thread>

#include "apps/cluster/cluster_options.hpp"
#include "apps/cluster/lab_service.hpp"
#include "apps/cluster/tables.hpp"
#include "apps/commands.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"
#include "apps/common/report.hpp"

namespace lichthof::apps {

namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

struct TopOptions {
  double every_s = 1;
  std::uint64_t count = 0;  ///< 0: on a terminal without end, elsewhere once
  ClusterOptions cluster;
  OutputOptions talk;
};

struct Load {
  nlohmann::json nodes, actors, jobs;
};

Expected<Load> load_of(const DeskClient& client) {
  Expected<nlohmann::json> answer = client.get("/v1/load");
  if (!answer) return answer.error();
  Load load;
  for (const auto& [key, part] :
       {std::pair{"nodes", &load.nodes}, std::pair{"actors", &load.actors}, std::pair{"jobs", &load.jobs}})
    *part = answer->is_object() ? answer->value(key, nlohmann::json::array()) : nlohmann::json::array();
  return load;
}

/// What the rows can be sorted by, and the key that chooses it. Numbers: the largest first.
struct Order {
  char key;
  const char* name;
  const char* field;
  bool is_text;
};
constexpr Order orders[] = {{'b', "busy", "busy_share", false},   {'r', "rays", "rays_per_s", false},
                            {'s', "shots", "shots_per_s", false}, {'m', "memory", "memory_bytes", false},
                            {'x', "mailbox", "mailbox", false},   {'n', "name", nullptr, true}};

void sort_rows(nlohmann::json& rows, const Order& order) {
  if (!rows.is_array()) return;
  const auto name = [](const nlohmann::json& row) {
    return text_at(row, "node") + text_at(row, "actor") + text_at(row, "name");
  };
  std::vector<nlohmann::json> sorted(rows.begin(), rows.end());
  std::stable_sort(sorted.begin(), sorted.end(), [&](const nlohmann::json& a, const nlohmann::json& b) {
    return order.is_text ? name(a) < name(b) : number_at(a, order.field) > number_at(b, order.field);
  });
  rows = sorted;
}

std::string totals(const Load& load) {
  double rays = 0, busy = 0;
  for (const nlohmann::json& node : load.nodes)
    rays += number_at(node, "rays_per_s"), busy += number_at(node, "busy_share");
  const std::size_t nodes = load.nodes.size();
  const double share = nodes > 0 ? busy / static_cast<double>(nodes) : 0;
  std::size_t running = 0, queued = 0;
  for (const nlohmann::json& job : load.jobs) {
    const std::string state = text_at(job, "state");
    queued += state == "queued";
    running += !is_over(state) && state != "queued";
  }
  return std::to_string(nodes) + (nodes == 1 ? " node " : " nodes ") + bar(share, 20) + " busy, " + short_number(rays) +
         " rays/s, jobs: " + std::to_string(running) + " running, " + std::to_string(queued) + " waiting";
}

// ---- Lines ------------------------------------------------------------------------------------------------------------

Status print_load(const TopOptions& options, const Load& load, bool is_one_of_many) {
  nlohmann::json document = {{"command", "top"},
                             {"version", LICHTHOF_VERSION},
                             {"nodes", load.nodes},
                             {"actors", load.actors},
                             {"jobs", load.jobs}};
  if (options.talk.json && is_one_of_many) {
    // A stream of documents has one on each line.
    OutputOptions plain;
    return print(plain, {}, {document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)});
  }
  Lines lines{totals(load)};
  for (const Lines& part : {node_lines(load.nodes), actor_lines(load.actors)})
    lines.insert(lines.end(), part.begin(), part.end());
  return print(options.talk, document, lines);
}

/// @returns false: interrupted
bool sleep_until(Clock::time_point end, const Interruption& interruption) {
  while (Clock::now() < end && !interruption.asked()) std::this_thread::sleep_for(milliseconds(50));
  return !interruption.asked();
}

Status print_loads(const TopOptions& options, const DeskClient& client, const Interruption& interruption) {
  const Interruption::Deferral deferral;
  const std::uint64_t count = std::max<std::uint64_t>(1, options.count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const Clock::time_point next = Clock::now() + milliseconds(static_cast<std::int64_t>(1000 * options.every_s));
    Expected<Load> load = load_of(client);
    if (!load) return load.error();
    sort_rows(load->actors, orders[0]);
    if (Status printed = print_load(options, *load, count > 1); !printed) return printed;
    if (i + 1 < count && !sleep_until(next, interruption)) return Error{ErrorCode::interrupted, "", "interrupted"};
  }
  return Done{};
}

// ---- Screen -----------------------------------------------------------------------------------------------------------

/// The terminal in our hands; given back whatever happens.
class Screen {
 public:
  Screen() {
    std::setlocale(LC_CTYPE, "");
    good_ = ::newterm(nullptr, stdout, stdin) != nullptr;
    if (!good_) return;
    ::cbreak(), ::noecho(), ::curs_set(0), ::keypad(stdscr, true), ::timeout(100);
  }
  ~Screen() {
    if (good_) ::endwin();
  }
  Screen(const Screen&) = delete;
  bool is_good() const { return good_; }

  /// One line, cut at the screen's edge; beyond its last row nothing.
  void line(int row, const std::string& text, attr_t attributes = A_NORMAL) {
    if (row < 0 || row >= LINES) return;
    ::move(row, 0);
    ::attrset(attributes);
    ::addnstr(text.c_str(), -1);
    ::attrset(A_NORMAL);
    if (static_cast<int>(text.size()) < COLS) ::clrtoeol();
  }

 private:
  bool good_ = false;
};

class Top {
 public:
  explicit Top(const DeskClient& client) : client_(client) {}
  Status run(Screen& screen, const TopOptions& options, const Interruption& interruption);

 private:
  void look();
  void draw(Screen& screen) const;
  bool obey(int key);

  const DeskClient& client_;
  Load load_;
  std::string problem_;
  const Order* order_ = &orders[0];
  int first_ = 0;  ///< actors scrolled away
};

void Top::look() {
  Expected<Load> load = load_of(client_);
  problem_ = load ? "" : load.error().text();
  if (!load) return;
  load_ = std::move(*load);
  sort_rows(load_.actors, *order_);
  sort_rows(load_.nodes,
            order_->is_text || load_.nodes.empty() || load_.nodes[0].contains(order_->field) ? *order_ : orders[0]);
}

void Top::draw(Screen& screen) const {
  ::erase();
  int row = 0;
  screen.line(row++, totals(load_), A_BOLD);
  screen.line(row++, problem_.empty() ? "" : problem_, A_REVERSE);
  const Lines nodes = node_lines(load_.nodes), actors = actor_lines(load_.actors);
  // Half of the screen at most for nodes: a large lab shall not hide what its actors do.
  const int room = std::max(3, (LINES - row) / 2);
  for (std::size_t i = 0; i < nodes.size() && static_cast<int>(i) < room; ++i)
    screen.line(row++, nodes[i], i == 0 ? A_REVERSE : A_NORMAL);
  row++;
  if (!actors.empty()) screen.line(row++, actors[0], A_REVERSE);
  for (std::size_t i = 1 + static_cast<std::size_t>(first_); i < actors.size() && row < LINES - 1; ++i)
    screen.line(row++, actors[i]);
  std::string keys = "sorted by " + std::string(order_->name) + ":";
  for (const Order& order : orders) keys += std::string(" ") + order.key + " " + order.name;
  screen.line(LINES - 1, keys + "  up/down scroll  q quit", A_DIM);
  ::refresh();
}

/// @returns false: leave
bool Top::obey(int key) {
  const int most = std::max(0, static_cast<int>(load_.actors.size()) - 1);
  if (key == 'q') return false;
  if (key == KEY_DOWN) first_ = std::min(most, first_ + 1);
  if (key == KEY_UP) first_ = std::max(0, first_ - 1);
  if (key == KEY_NPAGE) first_ = std::min(most, first_ + std::max(1, LINES / 2));
  if (key == KEY_PPAGE) first_ = std::max(0, first_ - std::max(1, LINES / 2));
  for (const Order& order : orders)
    if (key == order.key) {
      order_ = &order;
      sort_rows(load_.actors, order);
    }
  return true;
}

Status Top::run(Screen& screen, const TopOptions& options, const Interruption& interruption) {
  const auto period = milliseconds(static_cast<std::int64_t>(1000 * options.every_s));
  Clock::time_point next = Clock::now();
  std::uint64_t looks = 0;
  for (;;) {
    if (Clock::now() >= next) {
      if (options.count > 0 && looks == options.count) return Done{};
      look();
      ++looks;
      next = Clock::now() + period;
      draw(screen);
    }
    const int key = ::getch();  // waits a moment; also says when the terminal has another size
    if (interruption.asked()) return Error{ErrorCode::interrupted, "", "interrupted"};
    if (key == ERR) continue;
    if (!obey(key)) return Done{};
    draw(screen);
  }
}

Status top(const TopOptions& options, const Interruption& interruption) {
  log_as_asked(options.talk);
  const Expected<DeskClient> client = desk_client(options.cluster);
  if (!client) return client.error();
  if (options.talk.json || !::isatty(STDOUT_FILENO) || !::isatty(STDIN_FILENO))
    return print_loads(options, *client, interruption);
  // A first question before the screen is taken: its error stays readable.
  if (const Expected<Load> first = load_of(*client); !first) return first.error();
  const Interruption::Deferral deferral;
  Screen screen;
  if (!screen.is_good()) return print_loads(options, *client, interruption);
  return Top(*client).run(screen, options, interruption);
}

}  // namespace

void add_top(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<TopOptions>();
  CLI::App& command = *program.add_subcommand("top", "live load of a cluster's nodes and actors");
  command.add_option("--every", options->every_s, "seconds between looks (default 1)")
      ->check(number_within(0.1, 3600))
      ->option_text("SECONDS");
  command.add_option("--count", options->count, "so many looks (default: without end on a terminal, else 1)")
      ->check(number_within(1, 1e9))
      ->option_text("N");
  add_cluster_options(command, options->cluster);
  add_output_options(command, options->talk);
  command.footer(
      "Keys: b r s m x n sort by busy share, rays, shots, memory, mailbox, name; up and down scroll; q leaves.\n"
      "Where stdout is no terminal, lines are printed; with --json and --count one document a line.\n"
      "\nExamples:\n"
      "  lichthof top --cluster lab7:7410\n"
      "  lichthof top --json --count 60 > minute.jsonl");
  command.callback(
      [options, &chosen] { chosen = [options](Interruption& interruption) { return top(*options, interruption); }; });
}

}  // namespace lichthof::apps
