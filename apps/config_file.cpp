// SPDX-License-Identifier: MIT
#include "apps/config_file.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/program.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/suggestion.h"

namespace holdfast::apps {
namespace {

constexpr std::size_t kMaxBytesOfConfig = std::size_t{1} << 20;

// KEY = VALUE in a section; no values for an empty list.
struct Setting {
  std::string section, key;
  std::vector<std::string> values;
  int line = 0;
};

// Parser for the subset of TOML used by options: [sections], keys, quoted strings, numbers,
// booleans and lists of these; also accepts unquoted words as in INI.
class ConfigReader {
 public:
  ConfigReader(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  std::vector<Setting> Read() {
    std::vector<Setting> settings;
    std::string section;
    while (ToContent()) {
      if (Take('[')) {
        section = Bare("]");
        if (!Take(']')) Fail("has a section without ']'");
      } else {
        Setting& setting =
            settings.emplace_back(section, Bare("="), std::vector<std::string>{}, line_);
        if (setting.key.empty() || !Take('=')) Fail("is not KEY = VALUE");
        SkipBlanks();
        if (Take('[')) {
          ReadList(setting.values);
        } else {
          setting.values.push_back(Value(""));
        }
      }
      EndLine();
    }
    return settings;
  }

  [[noreturn]] void Fail(std::string_view problem) const {
    throw Error(fmt::format("{}:{}", name_, line_), problem,
                "Write lines like threads = 4 or output = \"held\"");
  }

 private:
  bool At(char c) const { return !text_.empty() && text_.front() == c; }
  bool Take(char c) {
    const bool there = At(c);
    if (there) Next();
    return there;
  }
  char Next() {
    const char c = text_.front();
    text_.remove_prefix(1);
    line_ += c == '\n';
    return c;
  }
  void SkipBlanks() {
    while (At(' ') || At('\t') || At('\r')) Next();
  }
  void SkipComment() {
    SkipBlanks();
    if (!At('#') && !At(';')) return;
    while (!text_.empty() && !At('\n')) Next();
  }
  // Skips blanks, comments and line ends; returns whether there is more.
  bool ToContent() {
    do SkipComment();
    while (Take('\n'));
    return !text_.empty();
  }
  void EndLine() {
    SkipComment();
    if (!text_.empty() && !At('\n')) Fail("has extra text after its value");
  }

  // Reads up to the end of the line, a comment or one of `ends`, without surrounding blanks.
  std::string Bare(std::string_view ends) {
    SkipBlanks();
    std::string word;
    while (!text_.empty() && !At('\n') && !At('#') && ends.find(text_.front()) == ends.npos) {
      word += Next();
    }
    while (!word.empty() && std::isspace(static_cast<unsigned char>(word.back()))) word.pop_back();
    return word;
  }

  std::string Value(std::string_view ends) {
    if (!At('"') && !At('\'')) {
      std::string word = Bare(ends);
      if (word.empty()) Fail("has no value");
      return word;
    }
    const char quote = Next();
    std::string text;
    while (!At(quote)) {
      if (text_.empty() || At('\n')) Fail("has a quote that is not closed");
      char c = Next();
      if (c == '\\' && quote == '"') {
        if (!At('"') && !At('\\')) Fail("has a '\\' that is neither \\\" nor \\\\");
        c = Next();
      }
      text += c;
    }
    Next();
    return text;
  }

  void ReadList(std::vector<std::string>& values) {
    while (true) {
      if (!ToContent()) Fail("is in a list without ']'");
      if (Take(']')) return;
      values.push_back(Value(",]"));
      if (ToContent() && !Take(',') && !At(']')) Fail("has no ',' between the values of a list");
    }
  }

  std::string_view text_;
  const std::string& name_;
  int line_ = 1;
};

// "evaluate fit": without the name of the program.
std::string NameInProgram(const CLI::App& command) {
  std::string name = command.get_name();
  for (const CLI::App* above = command.get_parent(); above; above = above->get_parent()) {
    name = above->get_name() + " " + name;
  }
  return name.substr(std::string_view("holdfast ").size());
}

// Returns whether a section belongs to another command of the program, or to a subcommand of one.
bool IsOfAnother(const CLI::App& command, const std::string& section) {
  const CLI::App* root = &command;
  while (root->get_parent() != nullptr) root = root->get_parent();
  const auto first_word = [](const std::string& name) { return name.substr(0, name.find(' ')); };
  return std::ranges::any_of(Subcommands(*root), [&](const CLI::App* known) {
    return first_word(section) == first_word(NameInProgram(*known));
  });
}

// Key in a file: without dashes.
std::string KeyOf(const CLI::Option& option) {
  return option.get_lnames().empty() ? option.get_name(true) : option.get_lnames().front();
}

bool IsFlag(const CLI::Option& option) { return option.get_expected_max() == 0; }

void Set(CLI::Option& option, const Setting& setting) {
  if (!IsFlag(option)) {
    option.add_result(setting.values);
  } else if (setting.values == std::vector<std::string>{"true"}) {
    option.add_result("true");
  } else if (setting.values != std::vector<std::string>{"false"}) {
    throw CLI::ConversionError("expected true or false");
  }
  if (!option.empty()) option.run_callback();
}

void Apply(CLI::App& command, const Setting& setting, const std::string& where) {
  std::vector<std::string> known;
  for (CLI::Option* option : command.get_options()) {
    if (!option->get_configurable()) continue;
    known.push_back(KeyOf(*option));
    if (known.back() != setting.key) continue;
    if (!option->empty()) return;  // the command line takes precedence
    try {
      Set(*option, setting);
    } catch (const CLI::ParseError& error) {
      throw Error(where, fmt::format("'{}': {}", setting.key, error.what()), "Correct the value");
    }
    return;
  }
  const std::string name = NameInProgram(command);
  throw Error(where, fmt::format("'{}' is not an option of 'holdfast {}'", setting.key, name),
              Suggestion(setting.key, known) +
                  fmt::format("Run 'holdfast {} --help' for the list of options", name));
}

void ReadConfig(CLI::App& command, const std::string& path) {
  const std::string text = ByteSource(path).Text(kMaxBytesOfConfig);
  const bool is_text = std::ranges::none_of(text, [](char c) {
    return std::iscntrl(static_cast<unsigned char>(c)) && c != '\n' && c != '\r' && c != '\t';
  });
  if (!is_text)
    throw Error(path, "is not a text file", "Give --config a file of lines KEY = VALUE");
  const std::string own = NameInProgram(command);
  // A command's own section takes precedence over settings before all sections.
  std::map<std::pair<bool, std::string>, Setting> settings;
  for (Setting& setting : ConfigReader(text, path).Read()) {
    std::ranges::replace(setting.section, '.', ' ');
    std::ranges::replace(setting.key, '_', '-');
    const std::string where = fmt::format("{}:{}", path, setting.line);
    const bool is_own = setting.section == own;
    if (!is_own && !setting.section.empty()) {
      if (IsOfAnother(command, setting.section)) continue;
      throw Error(where, fmt::format("'[{}]' is not a command", setting.section),
                  fmt::format("Name sections like [{}]", own));
    }
    const std::pair<bool, std::string> key(!is_own, setting.key);
    if (!settings.emplace(key, std::move(setting)).second) {
      throw Error(where, fmt::format("'{}' is set twice", key.second), "Keep one of them");
    }
  }
  for (const auto& [key, setting] : settings) {
    Apply(command, setting, fmt::format("{}:{}", path, setting.line));
  }
}

std::string AsValue(const std::string& text) {
  const bool bare = !text.empty() && text.find_first_not_of("0123456789.-+e") == text.npos;
  if (bare) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

// Unset options are printed as comments with their defaults.
void PrintConfig(const CLI::App& command) {
  fmt::print("[{}]\n", NameInProgram(command));
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_configurable()) continue;
    std::vector<std::string> values;
    for (const std::string& value : option->results()) values.push_back(AsValue(value));
    if (values.empty()) {
      std::string value = IsFlag(*option) ? "false" : option->get_default_str();
      const bool as_it_is = IsFlag(*option) || value.empty() || value.starts_with('[');
      if (!as_it_is) value = AsValue(value);
      fmt::print("# {} ={}{}\n", KeyOf(*option), value.empty() ? "" : " ", value);
    } else if (IsFlag(*option)) {
      fmt::print("{} = true\n", KeyOf(*option));
    } else if (values.size() == 1) {
      fmt::print("{} = {}\n", KeyOf(*option), values.front());
    } else {
      fmt::print("{} = [{}]\n", KeyOf(*option), fmt::join(values, ", "));
    }
  }
}

}  // namespace

void AddConfigOptions(CLI::App& command) {
  command
      .add_option_function<std::string>(
          "--config", [&command](const std::string& path) { ReadConfig(command, path); },
          "File of options, KEY = VALUE (TOML or INI); the command line takes precedence")
      ->configurable(false);
  command
      .add_flag_callback(
          "--print-config",
          [&command] {
            PrintConfig(command);
            throw CLI::Success();
          },
          "Print the current options in the format of --config and exit")
      ->configurable(false);
}

}  // namespace holdfast::apps
