// SPDX-License-Identifier: MIT
#include "solver/fit/prepared_object.h"

#include <algorithm>
#include <future>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "geometry/parallel.h"

namespace holdfast {

PreparedObject PrepareObject(LoadedObject object, int vertices, int threads) {
  std::vector<std::string> notes = object.notes;
  std::optional<Solid> solid;
  FitObject fit;
  auto prepared = std::async(threads > 1 ? std::launch::async : std::launch::deferred,
                             [&, stop = StopOn::Flag()] {
                               const StopOn inherited(stop);
                               solid.emplace(object.mesh);
                               fit = MakeFitObject(object.mesh, solid->distance, {}, threads);
                             });
  TriangleMesh simplified = ForFitting(object, vertices, &notes);
  prepared.get();
  fit.vertices = simplified.vertices;
  return {std::move(object), std::move(*solid), std::move(simplified), std::move(fit),
          std::move(notes)};
}

template <typename Value, typename Make>
std::shared_ptr<const Value> FitLibrary::Find(Shelf<Value>& shelf, const std::string& key,
                                              const Make& make) {
  std::promise<std::shared_ptr<const Value>> promise;
  std::shared_future<std::shared_ptr<const Value>> value;
  bool mine = false;
  {
    const std::scoped_lock guard(lock_);
    const auto found =
        std::ranges::find_if(shelf, [&](const auto& one) { return one.first == key; });
    if (found != shelf.end()) {
      shelf.splice(shelf.begin(), shelf, found);
    } else {
      mine = true;
      shelf.emplace_front(key, promise.get_future().share());
      if (shelf.size() > capacity_) shelf.pop_back();
    }
    value = shelf.front().second;
  }
  if (mine) {
    try {
      promise.set_value(make());
    } catch (...) {
      promise.set_exception(std::current_exception());  // the same error for all requests
    }
  }
  return value.get();
}

std::shared_ptr<const BodyModel> FitLibrary::Body(const std::string& path) {
  return Find(bodies_, path,
              [&] { return path.empty() ? BodyModel::Default() : BodyModel::Load(path); });
}

std::shared_ptr<const LoadedObject> FitLibrary::Loaded(const std::string& path_or_name,
                                                       double scale) {
  return Find(loaded_, fmt::format("{}\n{}", path_or_name, scale), [&] {
    return std::make_shared<const LoadedObject>(LoadObject(path_or_name, scale));
  });
}

std::shared_ptr<const PreparedObject> FitLibrary::Object(const std::string& path_or_name,
                                                         double scale, int vertices, int threads) {
  const std::string key = fmt::format("{}\n{}\n{}", path_or_name, scale, vertices);
  return Find(objects_, key, [&] {
    return std::make_shared<const PreparedObject>(
        PrepareObject(*Loaded(path_or_name, scale), vertices, threads));
  });
}

}  // namespace holdfast
