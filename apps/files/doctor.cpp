// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/common.h"
#include "geometry/error.h"
#include "geometry/export/export_clip.h"
#include "geometry/inspect/inspection.h"
#include "geometry/parallel.h"
#include "geometry/robot/robot_file.h"
#include "geometry/robot/robot_hand.h"
#include "geometry/robot/robot_kinematics.h"
#include "geometry/rotation.h"
#include "solver/robot/robot_anatomy.h"

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

// Symbol of a verdict, colored on a terminal.
std::string Symbol(Verdict verdict, bool colored) {
  const char* symbol = verdict == Verdict::kOk ? "✓" : verdict == Verdict::kWarning ? "!" : "✗";
  if (!colored) return symbol;
  const int color = verdict == Verdict::kOk ? 32 : verdict == Verdict::kWarning ? 33 : 31;
  return fmt::format("\033[{}m{}\033[0m", color, symbol);
}

std::string Text(const Inspection& inspection, bool colored) {
  std::string text = fmt::format("{}: {}\n", inspection.path.string(), inspection.title);
  for (const Fact& fact : inspection.facts) {
    if (!fact.text.empty()) text += fmt::format("    {}\n", fact.text);
  }
  for (const Finding& finding : inspection.findings) {
    text += fmt::format("  {} {}\n", Symbol(finding.verdict, colored), finding.text);
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

// Name of the root element of a file that begins as XML; empty for other files.
std::string RootElement(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string head(1 << 16, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  const std::size_t first = head.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (first == std::string::npos || head[first] != '<') return {};
  XmlTags tags(head);
  XmlTag tag;
  return tags.Next(tag) ? tag.name : "";
}

// Files referenced by the robot file that do not exist.
std::vector<std::string> MissingFiles(const RobotFile& file, const std::filesystem::path& path) {
  std::vector<std::string> missing;
  for (const auto& [name, found] : file.files) {
    if (!found.empty()) continue;
    try {
      FindRobotMesh(path, name);
    } catch (const Error&) {
      missing.push_back(name);
    }
  }
  return missing;
}

std::string RangeText(const RobotHand& hand, const RobotLink& link) {
  const RobotDof& dof = hand.dofs[static_cast<std::size_t>(link.dof)];
  const auto [low, high] =
      std::minmax({link.factor * dof.low + link.offset, link.factor * dof.high + link.offset});
  const bool turns = link.kind == RobotJointKind::kTurning;
  return fmt::format("{}{} {:.0f} to {:.0f} {}", link.joint,
                     link.joint == dof.name ? "" : fmt::format(" (follows {})", dof.name),
                     turns ? low / kDegree : 1e3 * low, turns ? high / kDegree : 1e3 * high,
                     turns ? "degrees" : "mm");
}

// Adds a line with the joints of these links, if there are any.
void AddJointFact(const RobotHand& hand, const std::string& part, const std::vector<int>& links,
                  Inspection& inspection) {
  std::vector<std::string> texts;
  for (const int k : links) {
    const RobotLink& link = hand.links[static_cast<std::size_t>(k)];
    if (link.dof >= 0) texts.push_back(RangeText(hand, link));
  }
  if (texts.empty()) return;
  const std::string text = fmt::format("{}", fmt::join(texts, ", "));
  inspection.AddFact(part + "_joints", text, fmt::format("{}: {}", part, text));
}

void AddHandFacts(const RobotHand& hand, Inspection& inspection) {
  RobotState state(hand);
  state.Evaluate(hand.Straight());
  Eigen::AlignedBox3d box;
  int with_shape = 0, moving = 0;
  for (int k = 0; k < hand.NumLinks(); ++k) {
    const RobotLink& link = hand.links[static_cast<std::size_t>(k)];
    with_shape += !link.shapes.empty();
    moving += link.dof >= 0;
    for (const TriangleMesh& shape : link.shapes) {
      for (const auto vertex : shape.vertices.colwise()) box.extend(state.RootFromLink(k) * vertex);
    }
  }
  const Eigen::Vector3d size = box.sizes();
  inspection.AddFact("links", hand.NumLinks(),
                     fmt::format("{} links, {} with a shape", hand.NumLinks(), with_shape));
  inspection.AddFact("links_with_shape", with_shape, "");
  inspection.AddFact("joints", hand.NumDofs(),
                     fmt::format("{} independent joints, {} mimic joints", hand.NumDofs(),
                                 moving - hand.NumDofs()));
  inspection.AddFact("following_joints", moving - hand.NumDofs(), "");
  std::vector<double> low, high;
  for (const RobotDof& dof : hand.dofs) {
    low.push_back(dof.low);
    high.push_back(dof.high);
  }
  inspection.AddFact("joint_low", std::move(low), "");
  inspection.AddFact("joint_high", std::move(high), "");
  inspection.AddFact("size_m", std::vector<double>(size.begin(), size.end()),
                     fmt::format("{:.0f} x {:.0f} x {:.0f} mm, joints straight", 1e3 * size.x(),
                                 1e3 * size.y(), 1e3 * size.z()));
}

// Adds the detected anatomy, and what `transfer --robot` does with it.
void AddAnatomy(const RobotHand& hand, Inspection& inspection) {
  const RobotAnatomy anatomy = FindAnatomy(hand);
  std::vector<std::string> found;
  std::set<int> of_fingers;
  for (const RobotFinger& finger : anatomy.fingers) {
    std::vector<int> links;
    for (const auto& phalanx : finger.links)
      links.insert(links.end(), phalanx.begin(), phalanx.end());
    of_fingers.insert(links.begin(), links.end());
    const std::string name = std::string(kFingerNames[static_cast<std::size_t>(finger.human)]);
    found.push_back(name);
    AddJointFact(hand, name, links, inspection);
  }
  std::vector<int> others;
  for (int k = 0; k < hand.NumLinks(); ++k) {
    if (!of_fingers.contains(k)) others.push_back(k);
  }
  AddJointFact(hand, "rest", others, inspection);
  const bool clear = anatomy.side_is_clear;
  const std::string side(SideName(anatomy.side));
  inspection.AddFact("fingers", static_cast<double>(found.size()),
                     fmt::format("{} fingers: {}", found.size(), fmt::join(found, ", ")));
  inspection.AddFact("side", clear ? side : "either",
                     clear ? fmt::format("a {} hand", side)
                           : "its shape does not show whether it is a right or a left hand");
  inspection.Ok(fmt::format(
      "transfer --robot works with clips in which {} hand holds an object{}",
      clear ? fmt::format("a {}", side) : "either",
      found.size() < kNumFingers
          ? fmt::format("; for each grasp, the {} human fingers that hold it best are used",
                        found.size())
          : ""));
  const std::string word = ShellWord(inspection.path);
  const bool demo = !clear || anatomy.side == Side::kRight;
  if (demo) inspection.next.push_back("holdfast fit demo_drink mug -o held");
  inspection.next.push_back(fmt::format("holdfast transfer {} --robot {} -o {}",
                                        demo ? "held" : "HELD_BY_LEFT_HAND", word,
                                        ShellWord("on_" + Stem(inspection.path))));
}

// Inspects a robot file, which geometry/ cannot read. Replaces the findings for a text file.
void InspectRobot(const std::string& root, Inspection& inspection) {
  const bool is_urdf = root == "robot";
  inspection.title = is_urdf ? "robot (URDF)" : "robot or scene (MJCF)";
  inspection.findings.clear();
  const std::string extension = ExtensionOf(inspection.path);
  std::vector<std::string> missing;
  try {
    const RobotFile file = CheckRobotFile(inspection.path);
    if (file.text.find("<xacro:") != std::string::npos) {
      inspection.title = "robot (xacro)";
      inspection.Fault("xacro files are not supported",
                       fmt::format("xacro {} > hand.urdf", ShellWord(inspection.path)));
      return;
    }
    if (is_urdf ? extension != ".urdf" : extension != ".xml" && extension != ".mjcf") {
      inspection.Fault(
          fmt::format("it is {}, but its name ends in '{}'", is_urdf ? "URDF" : "MJCF", extension),
          fmt::format("rename it to {}", is_urdf ? ".urdf" : ".xml"));
      return;
    }
    missing = MissingFiles(file, inspection.path);
    inspection.AddFact("files", static_cast<double>(file.files.size()), "");
    inspection.AddFact("missing_files", fmt::format("{}", fmt::join(missing, ", ")), "");
    const RobotHand hand = ReadRobotHand(inspection.path);
    AddHandFacts(hand, inspection);
    for (const std::string& note : hand.notes) inspection.Warn(note, "");
    AddAnatomy(hand, inspection);
  } catch (const Error& error) {
    inspection.Fault(error.Where() == inspection.path.string()
                         ? error.Problem()
                         : fmt::format("{}: {}", error.Where(), error.Problem()),
                     error.Remedy());
  }
  if (missing.empty()) return;
  constexpr std::size_t kMaxShown = 5;
  std::string text = fmt::format("{} referenced files are missing: ", missing.size());
  for (std::size_t k = 0; k < missing.size() && k < kMaxShown; ++k) {
    text += (k > 0 ? ", " : "") + missing[k];
  }
  if (missing.size() > kMaxShown) text += ", ...";
  inspection.Warn(std::move(text), "put them at these paths, relative to the robot file");
}

Inspection InspectAny(const std::string& path) {
  Inspection inspection = Inspect(path);
  const FileKind kind = inspection.identity.kind;
  if (kind != FileKind::kText && kind != FileKind::kUnknown && kind != FileKind::kHtml) {
    return inspection;
  }
  const std::string root = RootElement(path);
  if (root == "robot" || root == "mujoco") InspectRobot(root, inspection);
  return inspection;
}

int Run(const DoctorCommand& options) {
  const CommonOptions& common = options.common;
  std::vector<Inspection> inspections(options.files.size());
  Progress progress(common, "doctor");
  int done = 0;
  std::mutex lock;
  ParallelFor(static_cast<int>(options.files.size()), NumThreads(common), [&](int k) {
    if (Interrupted()) return;
    inspections[k] = InspectAny(options.files[k]);
    const std::scoped_lock guard(lock);
    progress.Update(++done, static_cast<int>(options.files.size()));
  });
  if (Interrupted()) return kInterrupted;

  const bool colored = ::isatty(STDOUT_FILENO) != 0;
  nlohmann::json summary = JsonHead("holdfast/doctor/1", common);
  summary["files"] = nlohmann::json::array();
  std::string text;
  int unsound = 0, warned = 0;
  for (const Inspection& inspection : inspections) {
    summary["files"].push_back(Json(inspection));
    text += (text.empty() ? "" : "\n") + Text(inspection, colored);
    unsound += inspection.Worst() == Verdict::kFault;
    warned += inspection.Worst() == Verdict::kWarning;
  }
  summary["unsound"] = unsound;
  summary["with_warnings"] = warned;
  if (inspections.size() > 1) {
    text += fmt::format("\n{} files: {} usable, {} of them with warnings; {} not usable\n",
                        inspections.size(), inspections.size() - unsound, warned, unsound);
  }
  PrintResult(common, summary, text);
  return unsound > 0 ? kInputFault : kDone;
}

}  // namespace

void AddDoctorCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DoctorCommand>();
  CLI::App* command = app.add_subcommand(
      "doctor", "Identify files: format, conventions, problems, and the next command");
  command
      ->add_option("files", options->files,
                   "Motions, body models, meshes, robot hands, result folders: any supported file")
      ->required();
  AddCommonOptions(
      *command, options->common, false,
      "  holdfast doctor GRAB/grab/s1/mug_drink_1.npz\n"
      "  holdfast doctor SMPLX_NEUTRAL.npz bottle.obj held --json\n"
      "Formats are detected from the content; nothing in a file is executed. Exit code 0:\n"
      "all files are usable, possibly with warnings; 1: some are not usable.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
