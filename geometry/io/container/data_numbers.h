// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "geometry/io/container/data_store.h"

namespace holdfast {

/// Whether a node is an instance of a chumpy class.
bool IsChumpy(const DataStore& store, NodeIndex index);

/// Returns the value of a chumpy array, as its `.r` would. The first releases of the body models
/// contain three kinds: a plain array (chumpy.ch.Ch: field x), selected elements of another array
/// (chumpy.reordering.Select: a, idxs, preferred_shape), and a reshaped array
/// (chumpy.reordering.Reshape: a, newshape). Throws Error for every other expression, which would
/// have to be evaluated.
NpyArray ChumpyValue(const DataStore& store, NodeIndex index, const std::string& where);

/// Whether a node is a scipy.sparse matrix (or array) in a readable format: csc, csr, coo.
bool IsSparse(const DataStore& store, NodeIndex index);

/// Returns the dense matrix, float64, in C order; duplicate entries are summed. Throws Error, named
/// `where`, if the parts are inconsistent or the dense matrix exceeds the memory limit of the file.
NpyArray SparseToDense(const DataStore& store, NodeIndex index, const std::string& where);

}  // namespace holdfast
