#include "apps/cluster/line_editor.hpp"

#include <fcntl.h>
#include <histedit.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cwchar>
#include <filesystem>
#include <vector>

namespace lichthof::apps {

namespace fs = std::filesystem;

namespace {

constexpr int kept_lines = 1000;
constexpr std::size_t most_shown = 60;

std::string common_start(const std::vector<std::string>& words) {
  std::string start = words.front();
  for (const std::string& word : words) {
    const auto [end, ignored] = std::mismatch(start.begin(), start.end(), word.begin(), word.end());
    start.erase(end, start.end());
  }
  return start;
}

}  // namespace

struct LineEditor::State {
  EditLine* editor = nullptr;
  History* history = nullptr;
  HistEvent event{};
  std::string file, prompt;
  Completer completer;
  Stop stop;

  static State* of(EditLine* editor) {
    State* state = nullptr;
    el_get(editor, EL_CLIENTDATA, &state);
    return state;
  }

  static char* prompt_of(EditLine* editor) { return of(editor)->prompt.data(); }

  /// Waits for one character, looking whether it should stop.
  static int read_character(EditLine* editor, wchar_t* character) {
    std::mbstate_t shift{};
    for (;;) {
      pollfd waiting{STDIN_FILENO, POLLIN, 0};
      const int ready = ::poll(&waiting, 1, 100);
      if (of(editor)->stop()) return 0;
      if (ready <= 0) continue;
      char byte = 0;
      if (::read(STDIN_FILENO, &byte, 1) != 1) return 0;
      const std::size_t length = std::mbrtowc(character, &byte, 1, &shift);
      if (length == static_cast<std::size_t>(-2)) continue;  // the first bytes of a longer one
      if (length == static_cast<std::size_t>(-1)) *character = L'?';
      return 1;
    }
  }

  static unsigned char complete(EditLine* editor, int) {
    const LineInfo* info = el_line(editor);
    const std::string up_to_cursor(info->buffer, info->cursor);
    const Completion offered = of(editor)->completer(up_to_cursor);
    if (offered.candidates.empty()) return CC_ERROR;
    const std::string typed = up_to_cursor.substr(offered.start);
    std::string word = common_start(offered.candidates);
    const bool single = offered.candidates.size() == 1;
    if (single && !word.ends_with('/')) word += ' ';
    if (word.size() > typed.size() || (single && word != typed)) {
      el_deletestr(editor, static_cast<int>(typed.size()));
      return el_insertstr(editor, word.c_str()) == 0 ? CC_REFRESH : CC_ERROR;
    }
    std::putchar('\n');
    for (std::size_t i = 0; i < std::min(most_shown, offered.candidates.size()); ++i)
      std::printf("%s  ", offered.candidates[i].c_str());
    std::printf(offered.candidates.size() > most_shown ? "...\n" : "\n");
    std::fflush(stdout);
    return CC_REDISPLAY;
  }
};

LineEditor::LineEditor(const std::string& history, Completer completer, Stop stop) : state_(std::make_unique<State>()) {
  State& state = *state_;
  state.file = history;
  state.completer = std::move(completer);
  state.stop = std::move(stop);
  state.history = history_init();
  ::history(state.history, &state.event, H_SETSIZE, kept_lines);
  ::history(state.history, &state.event, H_SETUNIQUE, 1);
  if (!state.file.empty()) ::history(state.history, &state.event, H_LOAD, state.file.c_str());
  state.editor = el_init("lichthof", stdin, stdout, stderr);
  el_set(state.editor, EL_CLIENTDATA, state_.get());
  el_set(state.editor, EL_PROMPT, &State::prompt_of);
  el_set(state.editor, EL_EDITOR, "emacs");
  el_set(state.editor, EL_HIST, ::history, state.history);
  el_set(state.editor, EL_GETCFN, &State::read_character);
  el_set(state.editor, EL_ADDFN, "lichthof-complete", "completes a word", &State::complete);
  el_set(state.editor, EL_BIND, "^I", "lichthof-complete", nullptr);
  el_set(state.editor, EL_BIND, "^R", "em-inc-search-prev", nullptr);
  // While a line is edited Ctrl-C is a key like others: it clears the line.
  el_set(state.editor, EL_SETTY, "-d", "-isig", nullptr);
  el_set(state.editor, EL_BIND, "^C", "em-kill-line", nullptr);
}

LineEditor::~LineEditor() {
  if (!state_->file.empty()) {
    std::error_code ignored;
    fs::create_directories(fs::path(state_->file).parent_path(), ignored);
    // There with the right mode before anything is in it.
    const int made = ::open(state_->file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (made >= 0) {
      ::fchmod(made, 0600);
      ::close(made);
      ::history(state_->history, &state_->event, H_SAVE, state_->file.c_str());
    }
  }
  el_end(state_->editor);
  history_end(state_->history);
}

std::optional<std::string> LineEditor::line(const std::string& prompt) {
  state_->prompt = prompt;
  int length = 0;
  const char* typed = el_gets(state_->editor, &length);
  if (!typed || length <= 0) return std::nullopt;
  std::string text(typed, static_cast<std::size_t>(length));
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  if (text.find_first_not_of(" \t") != std::string::npos)
    ::history(state_->history, &state_->event, H_ENTER, text.c_str());
  return text;
}

std::vector<std::string> files_beginning(const std::string& start) {
  const std::size_t slash = start.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : start.substr(0, slash + 1);
  const std::string name = start.substr(folder.size());
  std::vector<std::string> found;
  std::error_code problem;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, problem), end; !problem && entry != end;
       entry.increment(problem)) {
    const std::string file = entry->path().filename().string();
    std::error_code ignored;
    if (file.starts_with(name) && (file[0] != '.' || !name.empty()))
      found.push_back(folder + file + (entry->is_directory(ignored) ? "/" : ""));
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace lichthof::apps
