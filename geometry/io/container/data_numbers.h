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

/// Whether a node is a scipy.sparse matrix (or array) of a form that can be read: csc, csr, coo.
bool IsSparse(const DataStore& store, NodeIndex index);

/// The matrix with its zeros, float64, in C order; entries named twice add up. Throws Error, named
/// `where`, when its parts do not fit each other or the zeros would take more memory than the file
/// may.
NpyArray SparseToDense(const DataStore& store, NodeIndex index, const std::string& where);

}  // namespace holdfast
