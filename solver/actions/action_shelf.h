// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "solver/actions/action_plan.h"
#include "solver/actions/action_studio.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// Thread-safe cache of shared values, each created on first use.
template <typename Key, typename Value>
class Shelf {
 public:
  template <typename Make>
  const Value& Get(const Key& key, const Make& make) {
    std::unique_lock guard(lock_);
    auto& [its_lock, value] = places_[key];
    guard.unlock();
    const std::scoped_lock its_guard(its_lock);
    if (!value) value = make();
    return *value;
  }

 private:
  std::mutex lock_;
  std::map<Key, std::pair<std::mutex, std::unique_ptr<const Value>>> places_;
};

/// Subjects, objects and grasps of a set, shared by clips on any number of threads. Grasps are
/// stored in FOLDER/grasps and reused by later runs with the same body, shape and seed.
class ActionShelf {
 public:
  /// All arguments are kept by reference.
  ActionShelf(const std::shared_ptr<const BodyModel>& body, const std::filesystem::path& folder,
              const ActionSetOptions& options)
      : body_(body), folder_(folder), options_(options) {}

  /// 0 is s1.
  const ActionActor& Actor(int subject);
  /// `object`: embedded name; as it is or mirrored.
  const ActionProp& Prop(const std::string& object, bool mirrored);
  /// For CarryObject.
  const PreparedObject& Prepared(const std::string& object);

  /// Grasps of a job's prop by its subject: right hand, and also both hands if `both`.
  ActionGrasps GraspsOf(const ActionJob& job, bool both);
  /// One-handed grasps of an object, not mirrored, by a subject.
  std::vector<Grasp> GraspsOf(int subject, const std::string& object, Side side);

 private:
  const std::shared_ptr<const BodyModel>& body_;
  const std::filesystem::path& folder_;
  const ActionSetOptions& options_;
  Shelf<int, ActionActor> actors_;
  Shelf<std::pair<std::string, bool>, ActionProp> props_;
  Shelf<std::string, PreparedObject> prepared_;
};

}  // namespace holdfast
