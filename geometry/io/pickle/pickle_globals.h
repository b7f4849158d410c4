// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "geometry/io/container/data_store.h"
#include "geometry/io/pickle/pickle.h"
#include "geometry/io/pickle/pickle_text.h"

namespace holdfast {

/// What a name in a pickle stands for: the data that a call of it describes.
enum class GlobalRole {
  kInstance,        ///< class whose instances are kept as their fields
  kClassOnly,       ///< class or constant that may be named, not called
  kList,            ///< list, tuple, set: the items of its argument
  kDict,            ///< dict and similar: the pairs of its last argument
  kBytes,           ///< bytes and bytearray, of bytes or of a text and its encoding
  kLatin1,          ///< codecs.encode(text, "latin1"): bytes, in protocols 0 to 2
  kPath,            ///< parts of a path, as one text
  kComplex,         ///< rejected with a reason
  kReconstructor,   ///< copyreg._reconstructor(class, base, state)
  kNewObject,       ///< copyreg.__newobj__(class, arguments ...)
  kNdarray,         ///< numpy.ndarray and similar: an array whose state follows
  kReconstruct,     ///< numpy's _reconstruct(class, shape, type): the same
  kFromBuffer,      ///< numpy's _frombuffer(bytes, dtype, shape, order)
  kScalar,          ///< numpy's scalar(dtype, bytes)
  kDtype,           ///< numpy.dtype(text)
  kJoblibArray,     ///< joblib's NumpyArrayWrapper: an array whose bytes follow its state
  kTorchStorage,    ///< class of a storage; `element` is its type
  kTorchTensor,     ///< _rebuild_tensor(storage, offset, size, stride, ...)
  kTorchTensor3,    ///< the same with an untyped storage and a dtype as the seventh argument
  kTorchParameter,  ///< _rebuild_parameter(tensor, ...): the tensor
  kTorchFromType,   ///< _rebuild_from_type_v2(function, class, arguments, state)
  kTorchFromBytes,  ///< _load_from_bytes(file): a storage
};

struct AllowedGlobal {
  std::string_view module;  ///< in its oldest or plainest spelling, see FindAllowedGlobal
  std::string_view name;
  GlobalRole role = GlobalRole::kInstance;
  std::string_view element = {};  ///< "f4", "i8", "B2" (bfloat16), for storages and dtypes
};

/// Returns the row of the table, or null, in which case the pickle is rejected. Renamed modules
/// count as one: __builtin__ and builtins, copy_reg and copyreg, numpy._core and numpy.core,
/// scipy.sparse._csc and scipy.sparse.csc.
const AllowedGlobal* FindAllowedGlobal(std::string_view module, std::string_view name);

/// Index of a missing node.
inline constexpr NodeIndex kNoValue = std::numeric_limits<NodeIndex>::max();

/// State that the parts of the pickle reader share while one pickle is read.
struct PickleContext {
  DataStore& store;
  const PickleScanner& scanner;
  const PickleOptions& options;
  /// Rows of the table of allowed names, by the node of the name.
  std::unordered_map<NodeIndex, const AllowedGlobal*> globals = {};

  const AllowedGlobal* GlobalAt(NodeIndex index) const {
    const auto found = globals.find(index);
    return found == globals.end() ? nullptr : found->second;
  }
  const std::vector<NodeIndex>* ItemsAt(NodeIndex index) const {
    const auto* list = std::get_if<ListNode>(&store[index]);
    return list == nullptr ? nullptr : &list->items;
  }
  const DictNode* DictAt(NodeIndex index) const {
    const auto* dict = std::get_if<std::unique_ptr<DictNode>>(&store[index]);
    return dict == nullptr ? nullptr : dict->get();
  }
  ObjectNode* ObjectAt(NodeIndex index) const {
    auto* object = std::get_if<std::unique_ptr<ObjectNode>>(&store[index]);
    return object == nullptr ? nullptr : object->get();
  }
  /// For texts and bytes alike: Python 2 has one type for both.
  std::optional<std::string_view> TextAt(NodeIndex index) const {
    if (const auto* text = std::get_if<TextNode>(&store[index])) return text->text;
    if (const auto* bytes = std::get_if<BytesNode>(&store[index])) return bytes->bytes;
    return std::nullopt;
  }
  std::optional<std::int64_t> IntegerAt(NodeIndex index) const {
    if (const auto* integer = std::get_if<std::int64_t>(&store[index])) return *integer;
    return std::nullopt;
  }
  bool IsNone(NodeIndex index) const {
    return std::holds_alternative<std::monostate>(store[index]);
  }
  bool IsTrue(NodeIndex index) const {
    const auto* boolean = std::get_if<bool>(&store[index]);
    return boolean != nullptr ? *boolean : IntegerAt(index).value_or(0) != 0;
  }
  /// Sizes that are not negative, at most 32.
  std::optional<std::vector<std::size_t>> SizesAt(NodeIndex index) const;
};

}  // namespace holdfast
