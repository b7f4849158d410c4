// SPDX-License-Identifier: MIT
// Which folder may include which: a room uses only rooms on floors below its own.
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// From the ground up; rooms of one line do not know of each other.
const std::vector<std::vector<std::string>> kFloors = {
    {"geometry"},
    {"geometry/mesh", "geometry/io/container", "geometry/body/kernels", "generator/nn/kernels",
     "solver/kernels"},
    {"geometry/io/gltf/asset"},
    {"geometry/io/mesh", "geometry/io/pickle", "geometry/jobs", "generator/nn"},
    {"geometry/robot"},
    {"geometry/body", "geometry/object"},
    {"geometry/clip"},
    {"geometry/score", "geometry/io/motion", "geometry/io/markers", "geometry/render",
     "geometry/report"},
    {"geometry/retarget"},
    {"geometry/io/gltf", "geometry/conventions"},
    {"geometry/import"},
    {"geometry/inspect", "geometry/export"},
    {"generator/body"},
    {"generator/scripted"},
    {"generator/matching", "generator/wandr"},
    {"generator/walk_statistics", "generator/imos"},
    {"generator/actions"},
    {"solver/unknowns", "solver/hand"},
    {"solver/terms/hand", "solver/terms/body", "solver/terms/motion", "solver/grip"},
    {"solver/fit", "solver/grasp", "solver/body_ik", "solver/clearance", "solver/markers"},
    {"solver/handover", "solver/take", "solver/latent", "solver/recipes", "solver/robot"},
    {"solver/trial"},
    {"solver/score"},
    {"solver/carry", "solver/reach"},
    {"solver/actions", "solver/transfer"},
    {"solver/synthesis"},
    {"apps"},
    {"apps/files", "apps/fit", "apps/make", "apps/motion", "apps/report", "apps/score"},
};

struct Tree {
  std::set<std::string> rooms;
  std::vector<fs::path> headers;                                    // below the source's folder
  std::map<std::pair<std::string, std::string>, std::string> uses;  // who and whom: by which file
};

std::string RoomOf(const fs::path& file) { return file.parent_path().generic_string(); }

const Tree& Source() {
  static const Tree tree = [] {
    Tree t;
    const fs::path root = HOLDFAST_SOURCE_DIR;
    const std::regex include("^#include \"([^\"]+)\"");
    for (const char* top : {"geometry", "generator", "solver", "meshes", "apps"}) {
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / top)) {
        const fs::path& file = entry.path();
        if (file.extension() != ".h" && file.extension() != ".cpp") continue;
        const std::string room = RoomOf(fs::relative(file, root));
        t.rooms.insert(room);
        if (file.extension() == ".h") t.headers.push_back(fs::relative(file, root));
        std::ifstream text(file);
        for (std::string line; std::getline(text, line);) {
          std::smatch match;
          if (!std::regex_search(line, match, include)) continue;
          const std::string used = RoomOf(match[1].str());
          if (used != room) t.uses[{room, used}] = fs::relative(file, root).generic_string();
        }
      }
    }
    return t;
  }();
  return tree;
}

std::map<std::string, int> Floors() {
  std::map<std::string, int> floors;
  for (std::size_t k = 0; k < kFloors.size(); ++k) {
    for (const std::string& room : kFloors[k]) floors[room] = static_cast<int>(k);
  }
  return floors;
}

TEST(Rooms, AreAllInTheTableAndTheTableNamesNoOther) {
  std::set<std::string> named;
  for (const auto& [room, floor] : Floors()) named.insert(room);
  EXPECT_EQ(Source().rooms, named);
}

TEST(Rooms, UseOnlyWhatStandsBelowThem) {
  const std::map<std::string, int> floors = Floors();
  EXPECT_GT(Source().uses.size(), 100u) << "the includes were not read";
  for (const auto& [rooms, file] : Source().uses) {
    const auto& [room, used] = rooms;
    ASSERT_TRUE(floors.contains(used)) << file << " includes something of " << used;
    EXPECT_LT(floors.at(used), floors.at(room))
        << file << " of " << room << " includes something of " << used;
  }
}

// Two types of one name are one to the linker, which keeps the destructor of either.
TEST(Rooms, EveryTypeIsDefinedInOneHeader) {
  static const std::regex opens(R"(namespace ([\w:]+) \{)"),
      type(R"((?:struct|class|enum class) (\w+)(?: final)?(?: : .*)? ?\{.*)");
  std::map<std::string, std::string> seen;
  for (const fs::path& header : Source().headers) {
    std::ifstream file(HOLDFAST_SOURCE_DIR / header);
    std::string scope;
    std::smatch match;
    for (std::string line; std::getline(file, line);) {
      if (std::regex_match(line, match, opens)) scope = match[1].str() + "::";
      if (!std::regex_match(line, match, type)) continue;
      const auto [other, is_new] = seen.emplace(scope + match[1].str(), header.string());
      EXPECT_TRUE(is_new) << other->first << " of " << other->second << " is in " << header
                          << " too";
    }
  }
  EXPECT_GT(seen.size(), 300u);
}

// A command is what the program alone needs: nobody else includes it, and of the library's tests
// none does.
TEST(Rooms, NothingOfTheLibraryKnowsTheProgram) {
  for (const auto& [rooms, file] : Source().uses) {
    if (rooms.first.starts_with("apps")) continue;
    EXPECT_FALSE(rooms.second.starts_with("apps")) << file;
  }
}

}  // namespace
}  // namespace holdfast
