// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "geometry/io/container/data_store.h"

namespace holdfast {

/// Whether a node is an instance of a chumpy class.
bool IsChumpy(const DataStore& store, NodeIndex index);

/// The value of a chumpy array, as its `.r` would give it. The body models' first releases hold
/// three kinds: a plain array (chumpy.ch.Ch: the field x), a choice of elements of another
/// (chumpy.reordering.Select: a, idxs, preferred_shape) and one in another shape
/// (chumpy.reordering.Reshape: a, newshape). Throws Error for every other expression, as it would
/// have to be computed.
NpyArray ChumpyValue(const DataStore& store, NodeIndex index, const std::string& where);

}  // namespace holdfast
