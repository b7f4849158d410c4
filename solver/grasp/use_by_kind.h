// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>

#include "solver/grasp/grasp_use.h"
#include "solver/grasp/object_opening.h"

namespace holdfast {

/// How an object is taken for each kind of use; nothing where its shape is not of that kind.
/// `wanted`: it was asked for, so that less of a likeness will do.
std::optional<ObjectUse> AsHandle(const ObjectShape& shape, const ObjectOpening& opening,
                                  std::span<const Handle> handles);
std::optional<ObjectUse> AsBox(const ObjectShape& shape, const ObjectBox& box, bool wanted);
std::optional<ObjectUse> AsTool(const ObjectShape& shape, const ObjectOpening& opening,
                                bool wanted);
std::optional<ObjectUse> AsVessel(const ObjectShape& shape, const ObjectOpening& opening,
                                  bool wanted);
std::optional<ObjectUse> AsDish(const ObjectShape& shape, const ObjectOpening& opening,
                                bool wanted);

}  // namespace holdfast
