#pragma once

#include <functional>
#include <stdexcept>
#include <string>

namespace slender {

/// A result could not be written to its end: the disk is full, say. what() names the file and what is left of it.
class WriteError : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
};

/// The file that a result written under `path` may replace: the path itself if nothing is there yet or a regular file,
/// and what a symbolic link leads to, so that the link stays. Throws std::runtime_error for everything else: a
/// directory, a device, a FIFO, a link that leads nowhere.
std::string replaceablePath(const std::string& path);

/// With all folders above it. Throws std::runtime_error.
void makeFolder(const std::string& folder);

/// Throws std::runtime_error when something is at `path` that is neither a regular file nor a link to one: reading a
/// FIFO would wait for ever, and a device might have no end.
void requireRegularFile(const std::string& path);

/// Removes files of an earlier run from a folder, so that two runs are never mixed: regular files whose names `ours`
/// accepts and that begin with `beginning`. Other files stay. Throws std::runtime_error when such a name belongs to a
/// file that begins otherwise: this program did not write it.
void clearEarlierRun(const std::string& folder, const std::function<bool(const std::string& name)>& ours,
                     const std::string& beginning);

}   // namespace slender
