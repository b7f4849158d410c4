// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/io/container/npz.h"

namespace holdfast {

enum class DataKind {
  kNone,
  kBool,
  kInteger,
  kReal,
  kText,
  kBytes,
  kArray,  ///< numbers with a shape: numpy arrays and scalars, torch tensors
  kList,   ///< lists, tuples, sets, numpy arrays of Python objects
  kDict,  ///< names and values in file order; integer keys become decimal text, other keys are kept
          ///< aside
  kObject,  ///< instance of an allowed class: its class name and the fields of its state
};

/// All values of one data file. Values refer to each other by index, so that sharing and cycles in
/// the file are kept: code that traverses a store must bound the depth.
struct DataStore;

/// One value of a data file (pickle, torch archive, .npz with Python objects, JSON), as plain data.
/// A handle that keeps its file's values alive; cheap to copy. It knows its path from the file's
/// root, and every Error it throws names that path: "s1_mug.npz[body][params][transl]".
class DataValue {
 public:
  DataValue(std::shared_ptr<const DataStore> store, std::uint32_t index, std::string where);

  DataKind Kind() const;
  const std::string& Where() const { return where_; }
  /// Description for people: "dict of 5", "array (120, 3) of float32", "chumpy.ch.Ch".
  std::string Describe() const;

  /// For a dict or an object: whether a value of that name exists.
  bool Has(std::string_view name) const;
  std::vector<std::string> Names() const;
  /// Throws Error if this is not a dict or object, or has no such name (listing those it has).
  DataValue operator[](std::string_view name) const;
  std::optional<DataValue> Find(std::string_view name) const;

  /// Length and items of a list. For anything else, the length is zero and items throw Error.
  std::size_t Size() const;
  DataValue operator[](std::size_t index) const;

  /// Whether Array() returns numbers.
  bool HoldsNumbers() const;
  /// Numbers with their shape: an array, a number (0-d), nested lists of numbers of equal length, a
  /// scipy.sparse matrix (made dense), a chumpy array (its value). Throws Error for anything else.
  /// The last handle of an array that shares its bytes with nothing else moves them out uncopied.
  NpyMember Array() const&;
  NpyMember Array() &&;
  /// One number. Throws Error for several numbers, and for a fraction if an integer is requested.
  double Number() const;
  std::int64_t Integer() const;
  /// A text: Python's str or bytes, or a numpy text scalar.
  std::string Text() const;

  /// The file's values, for readers that combine the values of several files.
  const std::shared_ptr<const DataStore>& Store() const { return store_; }
  std::uint32_t Index() const { return index_; }

 private:
  std::shared_ptr<const DataStore> store_;
  std::uint32_t index_ = 0;
  std::string where_;
};

}  // namespace holdfast
