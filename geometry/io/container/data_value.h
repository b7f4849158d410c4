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
  kArray,   ///< numbers with a shape: numpy arrays and scalars, torch tensors
  kList,    ///< lists, tuples, sets, numpy arrays of Python objects
  kDict,    ///< names and values, in the file's order; integer keys go by their decimal text,
            ///< other keys are kept aside
  kObject,  ///< instance of an allowed class, as its class name and the fields of its state
};

/// All values of one data file. Values refer to each other by index: what a pickle shares is shared
/// here, and what loops in the file loops here, so whoever walks a store bounds the depth.
struct DataStore;

/// One value of a data file (pickle, torch archive, .npz with Python objects, JSON), as plain data.
/// A handle that keeps its file's values alive; cheap to copy. It knows its way from the file's
/// root, and every Error it throws names that way: "s1_mug.npz[body][params][transl]".
class DataValue {
 public:
  DataValue(std::shared_ptr<const DataStore> store, std::uint32_t index, std::string where);

  DataKind Kind() const;
  const std::string& Where() const { return where_; }
  /// What it is, for people: "dict of 5", "array (120, 3) of float32", "chumpy.ch.Ch".
  std::string Describe() const;

  /// Of a dict or an object: whether there is a value of that name.
  bool Has(std::string_view name) const;
  std::vector<std::string> Names() const;
  /// Throws Error when it is no dict or object, or has no such name (listing what is there).
  DataValue operator[](std::string_view name) const;
  std::optional<DataValue> Find(std::string_view name) const;

  /// Of a list: its length and items. Zero, or an Error, for everything else.
  std::size_t Size() const;
  DataValue operator[](std::size_t index) const;

  /// "scipy.sparse.csc.csc_matrix", as the file has it; empty for what is no object.
  const std::string& ClassName() const;

  /// Whether Array() gives something.
  bool HoldsNumbers() const;
  /// Numbers with their shape: an array, a number (0-d), nested lists of numbers of equal length, a
  /// scipy.sparse matrix (made dense), a chumpy array (its value). Throws Error for all else.
  /// The last handle of an array that shares its bytes with nothing else gives them away uncopied.
  NpyMember Array() const&;
  NpyMember Array() &&;
  /// One number. Throws Error for more than one, and for fractions where an integer is asked for.
  double Number() const;
  std::int64_t Integer() const;
  /// A text: Python's str or bytes, or a numpy text scalar.
  std::string Text() const;

  /// The file's values, for readers that put several files' values together.
  const std::shared_ptr<const DataStore>& Store() const { return store_; }
  std::uint32_t Index() const { return index_; }

 private:
  std::shared_ptr<const DataStore> store_;
  std::uint32_t index_ = 0;
  std::string where_;
};

}  // namespace holdfast
