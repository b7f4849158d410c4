// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "geometry/io/container/data_store.h"

namespace holdfast {

/// Whether a node is a scipy.sparse matrix (or array) of a form that can be read: csc, csr, coo.
bool IsSparse(const DataStore& store, NodeIndex index);

/// The matrix with its zeros, float64, in C order; entries named twice add up. Throws Error, named
/// `where`, when its parts do not fit each other or the zeros would take more memory than the file
/// may.
NpyArray SparseToDense(const DataStore& store, NodeIndex index, const std::string& where);

}  // namespace holdfast
