#pragma once

#include <functional>
#include <string>

namespace slender {

/// Removes files of an earlier run from a folder, so that two runs are never mixed: regular files whose names `ours`
/// accepts and that begin with `beginning`. Other files stay. Throws std::runtime_error when such a name belongs to a
/// file that begins otherwise: this program did not write it.
void clearEarlierRun(const std::string& folder, const std::function<bool(const std::string& name)>& ours,
                     const std::string& beginning);

}   // namespace slender
