// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/object/load_object.h"
#include "geometry/score/exact_intersection.h"
#include "solver/fit/fit_options.h"

namespace holdfast {

/// An object with all data that a fit needs; const, shared by fits.
struct PreparedObject {
  LoadedObject object;
  Solid solid;              ///< of the full mesh
  TriangleMesh simplified;  ///< for the pair terms
  FitObject fit;
  std::vector<std::string> notes;  ///< from loading and simplifying
};

/// Simplifies the object to `vertices` vertices for the pair terms and computes its distances, on
/// up to `threads` threads. Throws what Decimate and SignedDistance throw.
PreparedObject PrepareObject(LoadedObject object, int vertices = 300, int threads = 1);

/// Cache of body models and objects shared by several fits. Each is prepared once, by one thread.
/// Keeps the last few of each, so memory does not grow with the number of fits.
class FitLibrary {
 public:
  explicit FitLibrary(std::size_t capacity = 6) : capacity_(capacity) {}

  /// The embedded body if `path` is empty. Throws what BodyModel::Load throws.
  std::shared_ptr<const BodyModel> Body(const std::string& path);
  /// The object without fit data. Throws what LoadObject throws.
  std::shared_ptr<const LoadedObject> Loaded(const std::string& path_or_name, double scale);
  /// Throws what LoadObject and Decimate throw; prepares on `threads` threads.
  std::shared_ptr<const PreparedObject> Object(const std::string& path_or_name, double scale,
                                               int vertices, int threads);

 private:
  // By key, the most recently requested first.
  template <typename Value>
  using Shelf = std::list<std::pair<std::string, std::shared_future<std::shared_ptr<const Value>>>>;
  template <typename Value, typename Make>
  std::shared_ptr<const Value> Find(Shelf<Value>& shelf, const std::string& key, const Make& make);

  std::size_t capacity_;
  std::mutex lock_;
  Shelf<BodyModel> bodies_;
  Shelf<LoadedObject> loaded_;
  Shelf<PreparedObject> objects_;
};

}  // namespace holdfast
