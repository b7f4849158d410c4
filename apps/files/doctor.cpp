// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <cstdio>
#include <mutex>

#include <fmt/format.h>

#include "apps/common.h"
#include "geometry/inspect/inspection.h"
#include "geometry/parallel.h"

namespace holdfast::apps {
namespace {

struct DoctorCommand {
  CommonOptions common;
  std::vector<std::string> files;
};

std::string_view VerdictName(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "ok";
    case Verdict::kWarning:
      return "warning";
    case Verdict::kFault:
      break;
  }
  return "fault";
}

// The symbol of a verdict, coloured on a terminal.
std::string Symbol(Verdict verdict, bool coloured) {
  const char* symbol = verdict == Verdict::kOk ? "✓" : verdict == Verdict::kWarning ? "!" : "✗";
  if (!coloured) return symbol;
  const int colour = verdict == Verdict::kOk ? 32 : verdict == Verdict::kWarning ? 33 : 31;
  return fmt::format("\033[{}m{}\033[0m", colour, symbol);
}

std::string Text(const Inspection& inspection, bool coloured) {
  std::string text = fmt::format("{}: {}\n", inspection.path.string(), inspection.title);
  for (const Fact& fact : inspection.facts) {
    if (!fact.text.empty()) text += fmt::format("    {}\n", fact.text);
  }
  for (const Finding& finding : inspection.findings) {
    text += fmt::format("  {} {}\n", Symbol(finding.verdict, coloured), finding.text);
    if (!finding.fix.empty()) text += fmt::format("      -> {}\n", finding.fix);
  }
  for (const std::string& command : inspection.next) text += fmt::format("  next: {}\n", command);
  return text;
}

nlohmann::json Json(const Inspection& inspection) {
  nlohmann::json facts = nlohmann::json::object();
  for (const Fact& fact : inspection.facts) {
    if (fact.name.empty()) continue;
    std::visit([&](const auto& value) { facts[fact.name] = value; }, fact.value);
  }
  nlohmann::json findings = nlohmann::json::array();
  for (const Finding& finding : inspection.findings) {
    findings.push_back(
        {{"verdict", VerdictName(finding.verdict)}, {"text", finding.text}, {"fix", finding.fix}});
  }
  return {{"file", inspection.path.string()},
          {"kind", inspection.title},
          {"bytes", inspection.identity.bytes},
          {"gzipped", inspection.identity.gzipped},
          {"verdict", VerdictName(inspection.Worst())},
          {"facts", std::move(facts)},
          {"findings", std::move(findings)},
          {"next", inspection.next}};
}

int Run(const DoctorCommand& options) {
  const CommonOptions& common = options.common;
  std::vector<Inspection> inspections(options.files.size());
  Progress progress(common, "doctor");
  int done = 0;
  std::mutex lock;
  ParallelFor(static_cast<int>(options.files.size()), NumThreads(common), [&](int k) {
    if (Interrupted()) return;
    inspections[k] = Inspect(options.files[k]);
    const std::scoped_lock guard(lock);
    progress.Update(++done, static_cast<int>(options.files.size()));
  });
  if (Interrupted()) return kInterrupted;

  const bool coloured = ::isatty(STDOUT_FILENO) != 0;
  nlohmann::json summary = JsonHead("holdfast/doctor/1", common);
  summary["files"] = nlohmann::json::array();
  std::string text;
  int unsound = 0, warned = 0;
  for (const Inspection& inspection : inspections) {
    summary["files"].push_back(Json(inspection));
    text += (text.empty() ? "" : "\n") + Text(inspection, coloured);
    unsound += inspection.Worst() == Verdict::kFault;
    warned += inspection.Worst() == Verdict::kWarning;
  }
  summary["unsound"] = unsound;
  summary["with_warnings"] = warned;
  if (inspections.size() > 1) {
    text +=
        fmt::format("\n{} files: {} sound, {} of them with warnings; {} not usable as they are\n",
                    inspections.size(), inspections.size() - unsound, warned, unsound);
  }
  PrintResult(common, summary, text);
  return unsound > 0 ? kInputFault : kDone;
}

}  // namespace

void AddDoctorCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DoctorCommand>();
  CLI::App* command = app.add_subcommand(
      "doctor", "Identify files: format, conventions, faults, and what to type next");
  command
      ->add_option("files", options->files,
                   "Motions, body models, meshes, result folders: any supported file")
      ->required();
  AddCommonOptions(
      *command, options->common, false,
      "  holdfast doctor GRAB/grab/s1/mug_drink_1.npz\n"
      "  holdfast doctor SMPLX_NEUTRAL.npz bottle.obj held --json\n"
      "Formats are detected from the content; nothing in a file is executed. Exit code 0:\n"
      "all sound, perhaps with warnings; 1: some not usable as they are.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
