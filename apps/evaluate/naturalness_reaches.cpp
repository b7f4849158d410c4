// SPDX-License-Identifier: MIT
#include "apps/evaluate/naturalness_reaches.h"

#include <algorithm>
#include <mutex>

#include <fmt/format.h>

#include "apps/output.h"
#include "apps/reach_network.h"
#include "generator/wandr/reach_network.h"
#include "geometry/clip/clip.h"
#include "geometry/parallel.h"
#include "solver/evaluation/listed_reaches.h"
#include "solver/reach/reach_options.h"

namespace holdfast::apps {

namespace fs = std::filesystem;

void AddNaturalnessReachOptions(CLI::App& command, NaturalnessReachOptions& options) {
  CLI::Option* list = command.add_option(
      "--reaches", options.list,
      "Table of starts and goals (clip,frame,ahead,left,up a line: meters from the pelvis by its "
      "heading, up from the ground). Motions are made from each by every one of --methods, and are "
      "sets to compare: reaches/METHOD in the output");
  command
      .add_option("--reaches-root", options.root,
                  "Folder that the table's clips are named from [the table's]")
      ->needs(list);
  command
      .add_option("--methods", options.methods,
                  "Methods of 'reach' to make them by (comma separated)")
      ->delimiter(',')
      ->check(CLI::IsMember({"intention", "latent-opt", "vae-opt"}))
      ->needs(list)
      ->capture_default_str();
  command
      .add_option("--weights", options.weights,
                  "Network (.safetensors) in place of the embedded one")
      ->needs(list);
}

NaturalnessReaches MakeNaturalnessReaches(const NaturalnessReachOptions& options,
                                          const std::shared_ptr<const BodyModel>& body,
                                          const fs::path& folder, const CommonOptions& common) {
  NaturalnessReaches made;
  if (options.list.empty()) return made;
  const fs::path table = options.list;
  const std::vector<ListedReach> listed =
      ReadListedReaches(table, options.root.empty() ? table.parent_path() : fs::path(options.root));
  const ReachNetwork network = LoadReachNetwork(options.weights, common);
  const auto count = static_cast<int>(listed.size());
  Progress progress(common, "evaluate naturalness: reaches");
  std::mutex mutex;
  int done = 0;
  for (const std::string& method : options.methods) {
    fs::create_directories(folder / "reaches" / method);
    MotionSet set{method, {}};
    for (int i = 0; i < count; ++i) {
      const std::string name = fmt::format("reaches/{}/{:03d}.npz", method, i);
      set.files.push_back({(folder / name).string(), name});
    }
    int reached = 0, rests = 0;
    ParallelFor(count, NumThreads(common), [&](int i) {
      if (Interrupted()) return;
      const auto at = static_cast<std::size_t>(i);
      ReachOptions reach;
      reach.by = ReachByName(method);
      reach.seed = common.seed + static_cast<std::uint64_t>(i);
      const ListedMotion motion = MakeListedReach(listed[at], body, network.weights, reach);
      WriteClip(motion.clip, set.files[at].path);
      const std::lock_guard lock(mutex);
      reached += motion.reached ? 1 : 0;
      rests += motion.rests ? 1 : 0;
      progress.Update(++done, count * static_cast<int>(options.methods.size()));
    });
    if (Interrupted()) {
      made.stopped = true;
      return made;
    }
    made.text += fmt::format(
        "{}: {} of {} goals reached; the wrist within 2 cm in all of the last half second in {}\n",
        method, reached, count, rests);
    made.json.push_back({{"method", method},
                         {"motions", count},
                         {"reached", reached},
                         {"wrist_rests_within_2_cm", rests}});
    made.sets.push_back(std::move(set));
  }
  return made;
}

}  // namespace holdfast::apps
