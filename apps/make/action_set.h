// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "apps/fit/fit_library.h"
#include "apps/make/action_starts.h"
#include "solver/actions/action_clip.h"
#include "solver/actions/action_plan.h"

namespace holdfast::apps {

/// All that the clips of a set share, each made when it is first asked for. Threads may ask at the
/// same time; what is made once is never changed.
class ActionWorkshop {
 public:
  ActionWorkshop(std::shared_ptr<const BodyModel> body, ActionStarts starts,
                 const ActionSetOptions& options, std::filesystem::path folder, std::uint64_t seed);

  const ActionStarts& Starts() const { return starts_; }
  const ActionActor& Actor(int subject);
  const ActionProp& Prop(const std::string& object, bool mirrored);
  /// How a subject's right hand holds a prop, and both hands at once where `both`. Grasps are kept
  /// in FOLDER/grasps, and taken from there by a later run with the same body, shape and seed.
  std::unique_ptr<const ActionGrips> Grips(int subject, const std::string& object, bool mirrored,
                                           bool both);

  /// Makes the clips of one subject, object and hand, one after the other, and writes those that
  /// have no fault. Returns a line of the manifest for each.
  std::vector<nlohmann::json> Make(const std::vector<ActionJob>& jobs);

 private:
  std::vector<Grasp> GraspsOf(int subject, const std::string& object, bool mirrored);
  std::vector<GraspPair> PairsOf(int subject, const std::string& object, bool mirrored,
                                 const std::vector<Grasp>& right);
  nlohmann::json GraspKey(int subject, const std::string& object, bool mirrored);
  nlohmann::json MakeOne(const ActionJob& job, const ActionGrips& grips);

  template <typename Value>
  struct Shelf {
    std::mutex lock;
    std::unique_ptr<const Value> value;
  };
  template <typename Key, typename Value>
  Shelf<Value>& ShelfOf(std::map<Key, std::unique_ptr<Shelf<Value>>>& shelves, const Key& key);

  std::shared_ptr<const BodyModel> body_;
  ActionStarts starts_;
  ActionSetOptions options_;
  std::filesystem::path folder_;
  std::uint64_t seed_;
  FitLibrary library_{64};
  std::mutex lock_;
  std::map<int, std::unique_ptr<Shelf<ActionActor>>> actors_;
  std::map<std::pair<std::string, bool>, std::unique_ptr<Shelf<ActionProp>>> props_;
};

}  // namespace holdfast::apps
