// SPDX-License-Identifier: MIT
#include "apps/completion.h"

#include <iterator>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/program.h"
#include "geometry/io/mesh/load_object.h"

namespace holdfast::apps {
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

// {auto,right,left} of an option's type, as words.
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
         "Print a script of completions for bash: source <(holdfast --bash-completion)")
      ->trigger_on_parse();
}

}  // namespace holdfast::apps
