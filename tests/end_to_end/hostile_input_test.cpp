// SPDX-License-Identifier: MIT
// Every command with every kind of file it takes, each replaced by files that are nothing, never
// end, or lie; and every number of the command line by what is none. None may end in a signal,
// hang, speak in a library's words or leave anything behind, and each names the file or option.
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <mutex>
#include <regex>
#include <thread>

#include <gtest/gtest.h>

#include "geometry/parallel.h"
#include "tests/support/hostile_files.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using testing::HostileFile;
using testing::HostileFolder;
using testing::Listing;
using testing::ReadText;
using testing::TemporaryFolder;

// Of a processor's time, and, for what waits, of the clock's: machines are shared.
constexpr long kMaxSeconds = 10;
constexpr std::chrono::seconds kLongestWait(40);
constexpr int kThreads = 2;
constexpr const char* kNone = "none";  // no files of any kind, only special ones

HostileFolder& Folder() {
  static HostileFolder folder;
  return folder;
}

struct Case {
  std::string arguments;
  std::string named;      // is in the message
  bool may_pass = false;  // odd, but not wrong
};

// What a command reads, and which files stand in for it: "{}" in its arguments; "{here}" is where
// they lie.
struct Role {
  std::string arguments;
  std::string ending;
  const std::vector<HostileFile>& (HostileFolder::*special)() const = nullptr;
  bool may_pass = false;  // the command takes whatever it is given
};

void Replace(const std::string& what, const std::string& by, std::string& text) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at)) {
    text.replace(at, what.size(), by);
    at += by.size();
  }
}

std::vector<Case> CasesOf(const std::vector<Role>& roles) {
  std::vector<Case> cases;
  for (const Role& role : roles) {
    std::vector<HostileFile> files;
    if (role.ending != kNone) files = Folder().Any(role.ending);
    if (role.special != nullptr) {
      const auto& special = (Folder().*role.special)();
      files.insert(files.end(), special.begin(), special.end());
    }
    for (const HostileFile& file : files) {
      Case c{role.arguments, fs::path(file.name).filename().string(),
             role.may_pass || file.may_pass};
      Replace("{here}", Folder().Path().string(), c.arguments);
      Replace("{}", (Folder().Path() / file.name).string(), c.arguments);
      cases.push_back(std::move(c));
    }
  }
  return cases;
}

struct Outcome {
  int status = 0;  // as waitpid has it
  bool timed_out = false;
  std::string out, err, left;
};

Outcome Run(const std::string& arguments) {
  const TemporaryFolder output, folder;
  std::string command = "cd '" + folder.Path().string() + "' && ";
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  command += "ulimit -v 6000000 && ";
#endif
  command += "exec '" HOLDFAST_PROGRAM "' " + arguments + " </dev/null >'" +
             (output / "out").string() + "' 2>'" + (output / "err").string() + "'";
  const char* const words[] = {"sh", "-c", command.c_str(), nullptr};
  pid_t child = 0;
  Outcome outcome;
  if (::posix_spawn(&child, "/bin/sh", nullptr, nullptr, const_cast<char**>(words), environ) != 0) {
    outcome.err = "cannot be started";
    return outcome;
  }
  const auto end = std::chrono::steady_clock::now() + kLongestWait;
  rusage usage{};
  while (::wait4(child, &outcome.status, WNOHANG, &usage) == 0) {
    if (std::chrono::steady_clock::now() > end) {
      outcome.timed_out = true;
      ::kill(child, SIGKILL);
      ::waitpid(child, &outcome.status, 0);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  // A fit that succeeds may search for its grasp on all cores.
  const bool done = WIFEXITED(outcome.status) && WEXITSTATUS(outcome.status) == 0;
  const auto most = done ? 3 * kMaxSeconds : kMaxSeconds;
  if (usage.ru_utime.tv_sec + usage.ru_stime.tv_sec >= most) outcome.timed_out = true;
  outcome.out = ReadText(output / "out");
  outcome.err = ReadText(output / "err");
  outcome.left = Listing(folder.Path());
  return outcome;
}

// What is wrong with an outcome; empty when nothing is.
std::string Fault(const Case& c, const Outcome& outcome) {
  if (outcome.timed_out) return "hangs";
  if (!WIFEXITED(outcome.status))
    return "ends by signal " + std::to_string(WTERMSIG(outcome.status));
  const std::string said = outcome.out + outcome.err;
  static const std::regex library_text(
      R"(std::|boost|CGAL|[Cc]eres|glog|json\.exception|filesystem error|basic_string|vector::|)"
      R"(bad_alloc|terminate called|Check failed|libzip|stoi|stod|regex_error|WARNING: Logging)");
  std::smatch found;
  if (std::regex_search(said, found, library_text)) return "says '" + found.str() + "'";
  const int code = WEXITSTATUS(outcome.status);
  if ((code == 0 || code == 3) && c.may_pass) return "";
  if (code < 1 || code > 3) return "exits with " + std::to_string(code);
  if (!outcome.left.empty()) return "leaves " + outcome.left;
  if (said.find(c.named) == std::string::npos) return "does not name " + c.named;
  return "";
}

void ExpectAllHeld(const std::vector<Case>& cases) {
  std::mutex lock;
  ParallelFor(static_cast<int>(cases.size()), kThreads, [&](int i) {
    const Case& c = cases[i];
    const Outcome outcome = Run(c.arguments);
    const std::string fault = Fault(c, outcome);
    if (fault.empty()) return;
    const std::scoped_lock guard(lock);
    ADD_FAILURE() << "holdfast " << c.arguments << "\n  " << fault << "\n  "
                  << (outcome.out + outcome.err).substr(0, 600);
  });
}

constexpr auto kClips = &HostileFolder::Clips;
constexpr auto kMeshes = &HostileFolder::Meshes;
constexpr auto kModels = &HostileFolder::Models;
constexpr auto kMotions = &HostileFolder::Motions;
constexpr auto kLists = &HostileFolder::Lists;
constexpr auto kMaps = &HostileFolder::Maps;
constexpr auto kData = &HostileFolder::Data;
constexpr auto kResults = &HostileFolder::Results;
constexpr auto kBegun = &HostileFolder::Begun;

struct Group {
  std::string name;
  std::vector<Role> roles;
};

std::ostream& operator<<(std::ostream& out, const Group& group) { return out << group.name; }

const std::vector<Group> kGroups = {
    {"Fit",
     {{"fit {} cube -o out -q", ".npz", kClips},
      {"fit demo_drink cube --end 2 --body {} -o out -q", ".npz"},
      {"fit --batch {} -o out -q", ".list", kLists}}},
    {"FitMesh", {{"fit demo_drink {} --end 2 -o out -q --no-report", ".obj", kMeshes}}},
    {"OffhandAndRefine",
     {{"offhand {} cube -o out -q", ".npz"},
      {"offhand demo_pass {} -o out -q", ".ply"},
      {"refine {} -o out -q", ".npz", kClips},
      {"refine demo_drink --object {} -o out -q", ".stl"}}},
    {"Grasp",
     {{"grasp {} -o g.npz -q", ".obj", kMeshes},
      {"grasp cube --body {} -o g.npz -q", ".pkl"},
      {"grasp cube --hand both --clip {} -o g.npz -q", ".npz", kClips}}},
    {"RenderAndReport",
     {{"render {} -o a.png -q", ".npz", kClips},
      {"render demo_drink --frame 0 --object {} -o a.png -q", ".off"},
      {"render demo_drink --frame 0 --body {} -o a.png -q", ".npz"},
      {"report {} -o a.html -q", ".npz", kClips},
      {"report demo_drink --object {} -o a.html -q", ".ply"},
      {"report {} -o a.html -q", kNone, kResults},
      {"render {} -o a.png --frame 0 -q", kNone, kResults}}},
    {"ScoreAndExport",
     {{"score {} -q", ".npz", kClips},
      {"score demo_drink -r {} -q", ".npz"},
      {"score demo_drink --object {} -q", ".obj", kMeshes},
      {"export {} -o a.glb -q", ".npz", kClips},
      {"export demo_drink --object {} -o a.usda -q", ".obj"},
      {"export demo_drink --body {} -o a.bvh -q", ".npz"}}},
    {"ExportOfResults",
     {{"export {} -o a.xml -q", kNone, kResults},
      {"export {} -o metrics.csv -q", kNone, kResults}}},
    {"Import",
     {{"import {} -o a.npz -q", ".bvh", kMotions},
      {"import {} -o a.npz -q", ".npz", kClips},
      {"import {} -o a.npz -q", ".amc"},
      {"import {} -o a.npz -q", ".glb"},
      {"import {} -o a.npz -q", ".json", kData},
      {"import {} -o a.npz -q", ".pkl"},
      {"import {} -o a.npz -q", ".pt"},
      {"import {here}/whole.bvh --map {} -o a.npz -q", ".json", kMaps}}},
    {"BodyModels",
     {{"body info {}", ".npz", kModels},
      {"convert {} --from-body {here}/sound_model.npz --to-body {here}/sound_model.npz -o c.npz -q",
       ".npz"},
      {"convert demo_drink --from-body {} --to-body {here}/sound_model.npz -o c.npz -q", ".npz",
       kModels},
      {"import-weights {} b.pt -o w.safetensors -q", ".pt", kData}}},
    {"Decimate",
     {{"decimate {} -o a.ply -q", ".obj", kMeshes},
      {"decimate {} -o a.ply -q", ".ply"},
      {"decimate {} -o a.ply -q", ".stl"},
      {"decimate {} -o a.ply -q", ".off"},
      {"decimate cube -o a.ply -q --config {}", ".toml", kLists, true}}},
    {"Doctor",
     {{"doctor {}", kNone, kClips},
      {"doctor {}", ".npz", kModels, true},
      {"doctor {}", ".obj", kMeshes, true},
      {"doctor {}", ".bvh", kMotions, true},
      {"doctor {}", kNone, kMaps, true},
      {"doctor {}", ".safetensors", kData, true},
      {"doctor {}", kNone, kResults, true}}},
    {"Reach",
     {{"reach --goal 1,0.5,1 --from {} -o out -q", ".npz", kClips},
      {"reach --goal 1,0.5,1 --weights {} -o out -q", ".safetensors", kData},
      {"reach --goal 1,0.5,1 --body {} -o out -q", ".npz"},
      {"reach --goal 1,0.5,1 --method latent-opt --obstacle {} -o out -q", ".obj"},
      {"reach --goal 1,0.5,1 --object {} --grasp -o out -q", ".ply"}}},
    {"Synthesize",
     {{"synthesize --action drink --object {} --class mug -o out -q", ".obj"},
      {"synthesize --action drink --object mug --from {} -o out -q", ".npz", kClips},
      {"synthesize --action drink --object mug --weights {} -o out -q", ".safetensors", kData},
      {"synthesize --action drink --object mug --body {} -o out -q", ".npz"}}},
    {"Make",
     {{"make-reach-data {} -o out -q", ""},
      {"make-actions --starts {} -o out -q", ""},
      {"make-actions --count 0 --captured {} -o out -q", ""},
      {"fit --batch {here}/good.list -o {} -q", kNone, kBegun},
      {"make-actions --count 1 -o {} -q", kNone, kBegun}}}};

class HostileFiles : public ::testing::TestWithParam<Group> {};

TEST_P(HostileFiles, AreHeld) { ExpectAllHeld(CasesOf(GetParam().roles)); }

INSTANTIATE_TEST_SUITE_P(Every, HostileFiles, ::testing::ValuesIn(kGroups),
                         [](const auto& test) { return test.param.name; });

TEST(HostileInput, TheTableHasFourHundredCasesAndMore) {
  std::size_t count = 0;
  for (const Group& group : kGroups) count += CasesOf(group.roles).size();
  RecordProperty("cases", static_cast<int>(count));
  EXPECT_GE(count, 400u);
}

// Options that --help lists with a number: "--sigma FLOAT", "-n,--count INT:INT in [1 - 9]".
std::vector<std::pair<std::string, std::string>> NumberOptions(const std::string& command) {
  const Outcome help = Run(command + " --help");
  static const std::regex line(R"((--[a-z-]+) (FLOAT|INT|UINT)\b)");
  std::vector<std::pair<std::string, std::string>> options;
  for (std::sregex_iterator it(help.out.begin(), help.out.end(), line), end; it != end; ++it) {
    options.emplace_back((*it)[1], (*it)[2]);
  }
  return options;
}

TEST(HostileInput, NumbersOfTheCommandLine) {
  const std::map<std::string, std::string> commands = {
      {"fit", "fit demo_drink cube -o out"},
      {"offhand", "offhand demo_pass cube -o out"},
      {"grasp", "grasp cube -o g.npz"},
      {"import", "import a.bvh -o a.npz"},
      {"decimate", "decimate cube -o a.ply"},
      {"render", "render demo_drink -o a.png"},
      {"score", "score demo_drink"},
      {"export", "export demo_drink -o a.glb"},
      {"report", "report demo_drink -o a.html"},
      {"refine", "refine demo_drink -o out"},
      {"reach", "reach --goal 1,1,1 -o out"},
      {"synthesize", "synthesize --action drink --object mug -o out"},
      {"make-reach-data", "make-reach-data a -o out"},
      {"make-actions", "make-actions -o out"},
      {"import-weights", "import-weights a b -o out"}};
  std::vector<Case> cases;
  for (const auto& [command, line] : commands) {
    const auto options = NumberOptions(command);
    EXPECT_FALSE(options.empty()) << command;
    for (const auto& [option, type] : options) {
      const std::vector<std::string> floats = {"nan", "inf", "-inf", "1e300", "-1e30"};
      const std::vector<std::string> integers = {"1e9", "99999999999999999999999", "1.5"};
      for (const std::string& value : type == "FLOAT" ? floats : integers) {
        cases.push_back({line + " " + option + "=" + value, option});
      }
    }
  }
  for (const std::string goal :
       {"nan,0,1", "1e300,0,1", "1,2", "1,2,3,4", "a,b,c", ",,", "1e30,0,0"}) {
    cases.push_back({"reach -o out --goal=" + goal, "--goal"});
  }
  EXPECT_GE(cases.size(), 200u);
  ExpectAllHeld(cases);
}

}  // namespace
}  // namespace holdfast
