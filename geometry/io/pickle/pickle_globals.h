// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace holdfast {

/// What a name in a pickle stands for here: which data a call of it describes.
enum class GlobalRole {
  kInstance,        ///< class whose instances are kept as their fields
  kClassOnly,       ///< class or constant that may be named, not called
  kList,            ///< list, tuple, set: of the items of its argument
  kDict,            ///< dict and its kin: of the pairs of its last argument
  kBytes,           ///< bytes and bytearray, of bytes or of a text and its encoding
  kLatin1,          ///< codecs.encode(text, "latin1"): bytes, in protocols 0 to 2
  kPath,            ///< parts of a path, as one text
  kComplex,         ///< refused with a reason
  kReconstructor,   ///< copyreg._reconstructor(class, base, state)
  kNewObject,       ///< copyreg.__newobj__(class, arguments ...)
  kNdarray,         ///< numpy.ndarray and kin: an array whose state follows
  kReconstruct,     ///< numpy's _reconstruct(class, shape, type): the same
  kFromBuffer,      ///< numpy's _frombuffer(bytes, dtype, shape, order)
  kScalar,          ///< numpy's scalar(dtype, bytes)
  kDtype,           ///< numpy.dtype(text)
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

/// The row of the table, or null: then the pickle is refused. Modules that were renamed count as
/// one: __builtin__ and builtins, copy_reg and copyreg, numpy._core and numpy.core,
/// scipy.sparse._csc and scipy.sparse.csc.
const AllowedGlobal* FindAllowedGlobal(std::string_view module, std::string_view name);

}  // namespace holdfast
