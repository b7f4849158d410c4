// SPDX-License-Identifier: MIT
#pragma once

/// Files of named values (numpy, pickle, torch, JSON, safetensors) come in, detected from the
/// content; plain data come out.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "geometry/io/container/data_store.h"
#include "geometry/io/container/data_value.h"

namespace holdfast {

// Reads Python pickles, protocols 0 to 5, as plain data.
//
// Why this is safe on a file from anywhere:
// - *Nothing is executed.* A pickle is a program for a stack machine that may name any Python
//   function and have it called. Here there is no Python, and a name is only ever looked up in one
//   table (pickle_globals.cpp). Each row stands for data of a known layout: an array, a dtype, a
//   container, an instance as its fields. A name that is not in the table ends the reading with an
//   Error that says the name.
// - *No recursion.* The machine is one loop over the bytes; values refer to each other by index.
//   Loops in the file are loops of indices. Nesting costs heap, never the machine's own stack.
// - *Nothing is allocated on the word of the file.* A length is compared with the bytes that are
//   left before it is used. Text and bytes are views into the file; every other buffer is charged
//   to one budget (10 x the file's size + 64 MB) before it is made. Thus the time is bounded as
//   well: a step that costs more than its bytes in the file pays from that budget.
// - *All arithmetic on sizes is checked*, and arrays are checked against the bytes they stand on.
// - Everything that is wrong with a file ends in an Error with the position in bytes.

/// What a pickle may take.
struct PickleLimits {
  /// Steps from the root to the value that lies deepest (by the shortest way, if there are
  /// several).
  std::size_t max_depth = 1000;
  std::size_t max_values = std::size_t{1} << 28;
  /// Bytes; 0 stands for DataStore::DefaultLimit() of the pickle's size.
  std::size_t max_memory = 0;
};

/// Numbers of torch tensors lie outside the pickle, under a key.
struct TorchStorageRequest {
  std::string key;
  ElementType element;      ///< little-endian; kind 'u' of size 1 for untyped storages
  std::uint64_t count = 0;  ///< elements
};

struct PickleOptions {
  PickleLimits limits;
  /// Gives the bytes of a torch storage, count x element.size of them at least (fewer is an Error
  /// of the reader's). Asked once for each key, after the pickle's last byte, when `bytes_read` of
  /// ReadPickle is set already: in torch's older files the storages follow the pickle. Without it,
  /// a pickle that needs it is refused.
  std::function<DataBytes(const TorchStorageRequest&)> storage;
  /// Reads what torch.save wrote into bytes inside a pickle (torch.storage._load_from_bytes), and
  /// gives the bytes of the one storage it holds. Without it such a pickle is refused.
  std::function<DataBytes(std::span<const std::byte> file, ElementType& element)> nested_torch_file;
  /// Protocol 5's buffers beside the pickle, in the order of their use.
  std::vector<DataBytes> buffers;
};

/// The value of one pickle, which may be followed by other bytes: `bytes_read`, if given, gets the
/// pickle's length. `where` names the file in errors. Bytes without an owner are copied.
DataValue ReadPickle(DataBytes bytes, std::string where, const PickleOptions& options = {},
                     std::size_t* bytes_read = nullptr);

/// The value of a `.npy` of Python objects (dtype '|O'), given the pickle that follows its header.
/// A 0-d array (how numpy.savez keeps a dict) is the object itself; others are lists, of lists
/// where there are more dimensions.
DataValue ReadObjectArray(DataBytes pickle, std::string where, const PickleOptions& options = {});

/// Whether bytes may be a pickle, judged by how they begin: text formats never do so.
bool LooksLikePickle(std::span<const std::byte> head);

/// A value that stands alone, of an array: what a `.npy` member or a safetensors entry holds.
DataValue ArrayValue(NpyArray array, std::string where);

}  // namespace holdfast
