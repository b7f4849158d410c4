// SPDX-License-Identifier: MIT
// Every command writes the same bytes in every run and on any number of threads; wall times are in
// files of their own.
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// A command may read what those before it wrote. Not here are those whose own tests compare bytes:
// reach --method latent-opt, make-actions, make-reach-data.
const std::string kFixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures/";
const std::vector<std::string> kCommands = {
    "fit demo_drink mug -o fit --end 16",
    "fit --batch jobs.txt -o batch",
    "offhand demo_pass apple -o offhand --no-report",
    "refine fit -o refined",
    "grasp mug -o grasp.npz",
    "grasp mug --count 2 -o grasps",
    "transfer fit --scale 1.1 -o scaled",
    "transfer fit --variants 1 -o variants",
    "score fit fit -r fit --per-frame -o score.json --csv score.csv",
    "report fit -o page.html",
    "render fit -o sheet.png --sheet 2x1 --size 64x64",
    "export fit -o fit.glb",
    "export fit -o fit.bvh",
    "export fit -o fit.usda",
    "export fit -o fit.xml",
    "export fit -o fit.csv",
    "import fit.bvh -o imported.npz",
    "import " + kFixtures + "torch/s10_mug_drink_1.npz -o imos.npz",
    "convert fit --to-body " + kFixtures + "body_models/SMPLH_MALE.pkl -o smplh.npz",
    "decimate teapot -o teapot.ply",
    "doctor fit/clip.npz --json > doctor.json",
    "body info --json > body.json",
    "reach --goal 0.5,0.8,1.1 --samples 2 --all -o reach",
    "reach --track track.csv -o track --no-report",
    "reach --goal 0.3,0.5,0.8 --goal 0.3,0.5,1.0 --object apple --grasp --samples 1 -o taken "
    "--no-report",
    "synthesize --action drink --object mug -o drink --samples 1 --no-report",
};

void RunAll(const std::vector<std::string>& commands, const fs::path& folder, int threads) {
  fs::create_directories(folder);
  std::ofstream track(folder / "track.csv");
  for (int k = 0; k < 30; ++k) track << 0.2 + 0.005 * k << ",0.4,1.0\n";
  track.close();
  std::ofstream(folder / "jobs.txt")
      << "demo_drink mug end=8 name=a\ndemo_drink apple end=8 name=b\n";
  for (const std::string& command : commands) {
    const std::size_t redirect = command.find(" > ");
    const std::string arguments = command.substr(0, redirect) + " -q --threads " +
                                  std::to_string(threads) +
                                  (redirect == command.npos ? "" : command.substr(redirect));
    const testing::ProgramResult result = testing::RunHoldfast(folder, arguments);
    EXPECT_EQ(result.exit_code, 0) << command << "\n" << result.err;
  }
}

// What holds wall times: status lines of batches too.
bool HoldsTimes(const fs::path& path) {
  const std::string name = path.filename().string();
  return name == "timing.json" || name == "timing.html" || name.ends_with(".timing.json") ||
         path.string().find("/.jobs/") != std::string::npos;
}

std::set<fs::path> FilesBelow(const fs::path& folder) {
  std::set<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && !HoldsTimes(entry.path())) {
      files.insert(fs::relative(entry.path(), folder));
    }
  }
  return files;
}

void ExpectSameBytes(const std::vector<std::string>& commands) {
  const testing::TemporaryFolder folder;
  const fs::path one = folder / "one", two = folder / "two";
  RunAll(commands, one, 1);
  RunAll(commands, two, 2);
  const std::set<fs::path> files = FilesBelow(one);
  EXPECT_EQ(files, FilesBelow(two));
  EXPECT_GE(files.size(), commands.size());
  for (const fs::path& file : files) {
    EXPECT_TRUE(testing::ReadText(one / file) == testing::ReadText(two / file))
        << file << " differs between two runs";
  }
}

TEST(SameBytes, OfEveryCommandInTwoRuns) { ExpectSameBytes(kCommands); }

}  // namespace
}  // namespace holdfast
