// SPDX-License-Identifier: MIT
#include "geometry/io/container/object_fields.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {

const ObjectNode* ObjectAt(const DataStore& store, NodeIndex index) {
  const auto* object = std::get_if<std::unique_ptr<ObjectNode>>(&store[index]);
  return object == nullptr || (*object)->is_class ? nullptr : object->get();
}

const DictNode* NamesAt(const DataStore& store, NodeIndex index) {
  const ObjectNode* object = ObjectAt(store, index);
  if (object != nullptr && !object->fields) return nullptr;
  const auto* dict =
      std::get_if<std::unique_ptr<DictNode>>(&store[object != nullptr ? *object->fields : index]);
  return dict == nullptr ? nullptr : dict->get();
}

std::optional<NodeIndex> FindField(const DataStore& store, NodeIndex index, std::string_view name) {
  const DictNode* dict = NamesAt(store, index);
  if (dict == nullptr) return std::nullopt;
  const auto at = std::lower_bound(
      dict->by_name.begin(), dict->by_name.end(), name,
      [&](std::uint32_t place, std::string_view n) { return dict->named[place].first < n; });
  if (at == dict->by_name.end() || dict->named[*at].first != name) return std::nullopt;
  return dict->named[*at].second;
}

NodeIndex RequireField(const DataStore& store, NodeIndex index, std::string_view name,
                       const std::string& where) {
  if (const auto field = FindField(store, index, name)) return *field;
  const ObjectNode* object = ObjectAt(store, index);
  throw Error(where,
              fmt::format("is a {} without '{}'", object ? object->class_name : "dict", name),
              "The file is damaged, or of a version that is not known");
}

NpyMember PlainNumbers(const DataStore& store, NodeIndex index, const std::string& where) {
  if (ObjectAt(store, index) != nullptr) {
    throw Error(where,
                fmt::format("is a {} where an array is needed", ObjectAt(store, index)->class_name),
                "Save its value as an array");
  }
  return GatherNumbers(store, index, where);
}

}  // namespace holdfast
