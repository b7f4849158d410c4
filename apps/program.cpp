// SPDX-License-Identifier: MIT
#include "apps/program.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iterator>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/common.h"
#include "apps/output.h"
#include "geometry/error.h"
#include "geometry/object/load_object.h"
#include "geometry/suggestion.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast::apps {
namespace {

// The last parsed command, and its full name from the program on.
struct ReachedCommand {
  const CLI::App* app;
  std::string name;
};

ReachedCommand Reached(const CLI::App& app, std::string_view name) {
  ReachedCommand reached{&app, std::string(name)};
  for (auto parsed = app.get_subcommands(); !parsed.empty();
       parsed = reached.app->get_subcommands()) {
    reached.app = parsed.back();
    reached.name += " " + parsed.back()->get_name();
  }
  return reached;
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : Subcommands(app)) {
    names.push_back(command->get_name());
  }
  return names;
}

std::vector<std::string> OptionNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

// Error text for a word that is neither an option nor an argument.
std::optional<std::string> UnknownWord(const ReachedCommand& reached,
                                       const std::vector<std::string>& unknown) {
  if (unknown.empty()) return std::nullopt;
  const std::string& first = unknown.front();
  if (reached.app->get_require_subcommand_min() > 0 && !first.starts_with('-')) {
    return fmt::format("there is no command '{}'. {}", first,
                       Suggestion(first, CommandNames(*reached.app)));
  }
  const auto option =
      std::ranges::find_if(unknown, [](const std::string& word) { return word.starts_with('-'); });
  if (option == unknown.end()) return fmt::format("unexpected argument '{}'. ", first);
  const std::string given = option->substr(0, option->find('='));
  const std::vector<std::string> known = OptionNames(*reached.app);
  if (std::ranges::find(known, given) != known.end()) {
    return fmt::format("'{}' is given before the command. Put it after the command. ", given);
  }
  return fmt::format("there is no option '{}'. {}", given, Suggestion(given, known));
}

// Prints an error on stderr: as text after the name, or in the format of the command's --log.
void PrintFault(const ReachedCommand& reached, std::string_view name, int exit_code,
                const std::string& message, const std::string& where = {}) {
  const CLI::Option* const log = reached.app->get_option_no_throw("--log");
  if (log == nullptr || log->empty() || log->results().back() != "json") {
    fmt::print(stderr, "{}: {}\n", name, message);
    return;
  }
  nlohmann::ordered_json fields = {{"message", message}, {"exit_code", exit_code}};
  if (!where.empty()) fields["where"] = where;
  LogJson("error", "error", fields);
}

// Reports a usage error. A command that only groups subcommands lists them instead (as git does:
// the list on stdout, and an exit code for nothing done).
int ReportUsageFault(const CLI::App& app, std::string_view name, const CLI::ParseError& error) {
  const ReachedCommand reached = Reached(app, name);
  std::optional<std::string> fault = UnknownWord(reached, app.remaining(true));
  const bool alone = reached.app->get_require_subcommand_min() > 0;
  if (!fault && alone) {
    fmt::print("{}", app.help());
    return kUsageFault;
  }
  if (!fault) fault = error.what() + std::string(". ");
  PrintFault(reached, reached.name, kUsageFault,
             fmt::format("{}Run '{} --help' for {}.", *fault, reached.name,
                         alone ? "the list" : "its options and examples"));
  return kUsageFault;
}

}  // namespace

std::vector<const CLI::App*> Subcommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

void RequireNumbersInRange(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    if (!type.starts_with("FLOAT") && !type.starts_with("UINT")) continue;
    const double most = type.starts_with("UINT") ? 0x1p64 : 1e9;
    option->check([most](const std::string& text) -> std::string {
      const double value = std::strtod(text.c_str(), nullptr);
      if (std::abs(value) <= most && value < 0x1p64) return "";
      return fmt::format("{} is not a number within {:g}", text, most);
    });
  }
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) {
    RequireNumbersInRange(*command);
  }
}

int RunProgram(CLI::App& app, std::string_view name, int argc, char** argv, const int& exit_code) {
  WatchForInterrupt();
  QuietCeres();
  RequireNumbersInRange(app);
  const auto fault = [&](int code, const std::string& message, const std::string& where = {}) {
    PrintFault(Reached(app, name), name, code, message, where);
    return code;
  };
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const Ended& ended) {
    return ended.exit_code;
  } catch (const CLI::ParseError& error) {
    return error.get_exit_code() == 0 ? app.exit(error) : ReportUsageFault(app, name, error);
  } catch (const FitFailure& error) {
    return fault(kFitFault, error.what());
  } catch (const Error& error) {
    return fault(kInputFault, error.what(), error.Where());
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string path = error.path1().string();
    return fault(
        kInputFault,
        fmt::format("{}: cannot be used ({}). Check the path.", path, error.code().message()),
        path);
  } catch (const std::bad_alloc&) {
    return fault(kInputFault, "out of memory. Give a smaller input, or fewer threads.");
  } catch (const std::exception& error) {
    return fault(kInputFault, error.what());
  }
}

namespace {

constexpr std::string_view kScriptHead = R"(# bash completion for holdfast
_holdfast() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command= i words= commands options
  COMPREPLY=()
  # bash splits at '=': --hand=left are three words.
  [ "$word" = = ] && word=
  [ "$before" = = ] && before=${COMP_WORDS[COMP_CWORD - 2]}
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case "${command:+$command }${COMP_WORDS[i]}" in
)";

constexpr std::string_view kScriptTail = R"(  esac
  case $word in
    -*) words=$options ;;
    *) [ -n "$words" ] || words=$commands ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$word"))
  case $word in -*) ;; *) [ -n "$commands" ] || COMPREPLY+=($(compgen -f -- "$word")) ;; esac
}
complete -o filenames -F _holdfast holdfast
)";

struct Command {
  std::string path;  // "evaluate fit"
  const CLI::App* app;
};

void Collect(const CLI::App& app, const std::string& path, std::vector<Command>& commands) {
  commands.push_back({path, &app});
  for (const CLI::App* command : Subcommands(app)) {
    Collect(*command, path.empty() ? command->get_name() : path + " " + command->get_name(),
            commands);
  }
}

std::string Names(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return fmt::format("{}", fmt::join(names, " "));
}

// Choices {auto,right,left} in an option's type, as words.
std::string Choices(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t from = type.find('{'), to = type.find('}', from);
  if (from == std::string::npos || to == std::string::npos) return "";
  std::string words = type.substr(from + 1, to - from - 1);
  for (char& c : words) {
    if (c == ',') c = ' ';
  }
  return words;
}

}  // namespace

std::string BashCompletion(const CLI::App& app) {
  std::vector<Command> commands;
  Collect(app, "", commands);
  std::string script(kScriptHead);
  auto out = std::back_inserter(script);
  for (const Command& command : commands) {
    if (!command.path.empty()) fmt::format_to(out, "      '{0}') command='{0}' ;;\n", command.path);
  }
  script += "    esac\n  done\n  case $command in\n";
  for (const Command& command : commands) {
    std::vector<std::string> names;
    for (const CLI::App* below : Subcommands(*command.app)) {
      names.push_back(below->get_name());
    }
    std::string options, positionals;
    for (const CLI::Option* option : command.app->get_options()) {
      if (option->nonpositional()) options += Names(*option) + " ";
      if (option->get_positional() && option->get_name(true) == "object") {
        positionals = fmt::format("{}", fmt::join(EmbeddedObjectNames(), " "));
      }
    }
    fmt::format_to(out, "    '{}')\n      commands='{}'\n      options='{}'\n", command.path,
                   fmt::join(names, " "), options);
    if (!positionals.empty()) fmt::format_to(out, "      words='{}'\n", positionals);
    script += "      case $before in\n";
    for (const CLI::Option* option : command.app->get_options()) {
      const std::string choices = Choices(*option);
      if (choices.empty() || !option->nonpositional()) continue;
      std::string pattern = Names(*option);
      for (std::size_t at = 0; (at = pattern.find(' ', at)) != std::string::npos; ++at) {
        pattern[at] = '|';
      }
      fmt::format_to(out, "        {}) words='{}' ;;\n", pattern, choices);
    }
    script += "      esac ;;\n";
  }
  script += kScriptTail;
  return script;
}

void AddCompletionOption(CLI::App& app) {
  app.add_flag_callback(
         "--bash-completion",
         [&app] {
           fmt::print("{}", BashCompletion(app));
           throw CLI::Success();
         },
         "Print a bash completion script; to load it: source <(holdfast --bash-completion)")
      ->trigger_on_parse();
}

}  // namespace holdfast::apps
