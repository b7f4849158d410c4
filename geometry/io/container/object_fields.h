// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "geometry/io/container/data_store.h"

namespace holdfast {

/// The instance (not the class) at an index, or null.
const ObjectNode* ObjectAt(const DataStore& store, NodeIndex index);

/// The names of a dict, or of an instance's state; null for everything else. After Finish().
const DictNode* NamesAt(const DataStore& store, NodeIndex index);

std::optional<NodeIndex> FindField(const DataStore& store, NodeIndex index, std::string_view name);
/// Throws Error when there is none.
NodeIndex RequireField(const DataStore& store, NodeIndex index, std::string_view name,
                       const std::string& where);

/// Numbers of a field that is itself an array or a list of numbers, not another instance: what
/// keeps instances within instances from recursing. Throws Error for everything else.
NpyMember PlainNumbers(const DataStore& store, NodeIndex index, const std::string& where);

}  // namespace holdfast
