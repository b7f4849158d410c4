// SPDX-License-Identifier: MIT
// Fits objects to motions, every object to every motion, on all cores, and scores the results.
//
//   batch_fit [FOLDER [CLIP,CLIP,... [OBJECT,OBJECT,...]]]
//
// Clips and objects: files or embedded names. Writes FOLDER/CLIP_OBJECT.npz, prints metrics as CSV.
#include <cstdio>
#include <filesystem>
#include <optional>
#include <sstream>
#include <vector>

#include "geometry/import/load_clip.h"
#include "geometry/parallel.h"
#include "solver/carry/carry.h"
#include "solver/score/score_output.h"

using namespace holdfast;

std::vector<std::string> Names(const std::string& list) {
  std::vector<std::string> names;
  std::istringstream text(list);
  for (std::string name; std::getline(text, name, ',');) names.push_back(name);
  return names;
}

int main(int argc, char** argv) try {
  const std::filesystem::path folder = argc > 1 ? argv[1] : "fitted";
  const auto clips = Names(argc > 2 ? argv[2] : "demo_drink,demo_inspect");
  std::filesystem::create_directories(folder);

  // Loaded and prepared once; const, so any number of threads may use them.
  std::vector<LoadedClip> motions;
  for (const std::string& name : clips) motions.push_back(LoadClip(name));
  std::vector<PreparedObject> objects;
  for (const std::string& name : Names(argc > 3 ? argv[3] : "mug,bottle"))
    objects.push_back(PrepareObject(LoadObject(name)));

  const int count = static_cast<int>(motions.size() * objects.size());
  std::vector<std::optional<ClipScore>> scored(count);  // by pair: the order of work is open
  ParallelFor(count, AvailableThreads(), [&](int pair) {
    const LoadedClip& motion = motions[pair / objects.size()];
    const PreparedObject& object = objects[pair % objects.size()];
    const std::filesystem::path clip = clips[pair / objects.size()];
    const std::string name = clip.stem().string() + "_" + object.object.name;
    const CarryReport held = CarryObject(motion.clip, motion.body, object);
    if (held.status != CarryStatus::kCarried) {
      std::fprintf(stderr, "%s: not fitted: %s\n", name.c_str(), held.grasp.status.c_str());
      return;
    }
    WriteClip(held.clip, folder / (name + ".npz"));
    ClipScene scene;
    scene.source = name;
    scene.clip = held.clip;
    scene.body = motion.body.model;
    scene.betas = motion.body.betas;
    scene.object = object.object.mesh;
    scored[pair] = ScoreClip(scene);
  });

  std::vector<ClipScore> scores;
  for (const auto& score : scored)
    if (score) scores.push_back(*score);
  std::fputs(ScoreCsv(scores, ScoreOptions()).c_str(), stdout);
  return static_cast<int>(scores.size()) == count ? 0 : 1;
} catch (const Error& error) {  // where, what is wrong, what to do
  std::fprintf(stderr, "batch_fit: %s\n", error.what());
  return 1;
}
