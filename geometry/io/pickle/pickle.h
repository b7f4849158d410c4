// SPDX-License-Identifier: MIT
#pragma once

/// Reads files of named values (numpy, pickle, torch, JSON, safetensors), detected from the
/// content, as plain data.

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
// Why this is safe for a file from any source:
// - *Nothing is executed.* A pickle is a program for a stack machine that may name any Python
//   function and have it called. Here there is no Python, and a name is only ever looked up in one
//   table (pickle_globals.cpp). Each row stands for data of a known layout: an array, a dtype, a
//   container, an instance as its fields. A name that is not in the table ends the reading with an
//   Error that states the name.
// - *No recursion.* The machine is one loop over the bytes; values refer to each other by index.
//   Cycles in the file are cycles of indices. Nesting takes heap, never the machine's own stack.
// - *No allocation trusts the file.* A length is compared with the remaining bytes before it is
//   used. Text and bytes are views into the file; every other buffer is charged to one budget (10 x
//   the file's size + 64 MB) before it is allocated. This bounds the time as well: a step that
//   costs more than its bytes in the file is charged to that budget.
// - *All arithmetic on sizes is checked*, and arrays are checked against their bytes.
// - Every fault of a file ends in an Error with the position in bytes.

/// Request for numbers of a torch tensor, which are stored outside the pickle, under a key.
struct TorchStorageRequest {
  std::string key;
  ElementType element;      ///< little-endian; kind 'u' of size 1 for untyped storages
  std::uint64_t count = 0;  ///< elements
};

struct PickleOptions {
  /// Bytes that the values may take; 0 stands for DataStore::DefaultLimit() of the pickle's size.
  std::size_t max_memory = 0;
  /// Returns the bytes of a torch storage, at least count x element.size (fewer are an Error of the
  /// reader). Called once per key, after the pickle's last byte, when `bytes_read` of ReadPickle is
  /// already set: in older torch files the storages follow the pickle. Without it, a pickle that
  /// needs it is rejected.
  std::function<DataBytes(const TorchStorageRequest&)> storage;
  /// Reads what torch.save wrote into bytes inside a pickle (torch.storage._load_from_bytes), and
  /// returns the bytes of its only storage. Without it, such a pickle is rejected.
  std::function<DataBytes(std::span<const std::byte> file, ElementType& element)> nested_torch_file;
};

/// Returns the value of one pickle, which other bytes may follow: `bytes_read`, if given, is set to
/// the pickle's length. `where` names the file in errors. Bytes without an owner are copied.
DataValue ReadPickle(DataBytes bytes, std::string where, const PickleOptions& options = {},
                     std::size_t* bytes_read = nullptr);

/// Returns the value of a `.npy` of Python objects (dtype '|O') from the pickle that follows its
/// header. A 0-d array (as numpy.savez stores a dict) is the object itself; others are lists,
/// nested for several dimensions.
DataValue ReadObjectArray(DataBytes pickle, std::string where, const PickleOptions& options = {});

/// Whether bytes may be a pickle, judged by their beginning: text formats never begin like that.
bool LooksLikePickle(std::span<const std::byte> head);

/// A value of a single array, such as a `.npy` member or a safetensors entry.
DataValue ArrayValue(NpyArray array, std::string where);

}  // namespace holdfast
