#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace slender::study {

/// A line of the package's sources, or of others'.
struct SourceLine
{
  std::string file;   ///< from the package's folder on (src/..., include/...); of others: as the line tables name it
  int line = 0;
};

/// Instructions of one line of one function, or of the calls that it makes to another.
struct InstructionCost
{
  std::string function, function_file;   ///< file: as of SourceLine
  SourceLine at;                         ///< of code that was inlined: where it comes from
  /// empty: the line's own instructions; else what the callee took, with all that it called
  std::string callee, callee_file;
  std::uint64_t calls = 0, instructions = 0;
};

/// What one warm step of a scene takes, the program around it included.
struct StepProfile
{
  std::vector<InstructionCost> costs;   ///< sums over `steps` steps
  std::uint64_t instructions = 0;       ///< likewise
  int steps = 0;
};

/// Memory taken from the heap in one place.
struct Allocation
{
  std::uint64_t blocks = 0, bytes = 0;
  std::vector<SourceLine> stack;        ///< innermost first
  std::vector<std::string> functions;   ///< of the stack
};

/// Runs `simulate` under valgrind's tools.
class Profiler
{
public:
  /// `simulate` [path]; `sources` [folder of the package]: paths of its files are told relative to it. Makes a
  /// temporary folder. Throws std::runtime_error with what to install or build when valgrind, the program or the
  /// sources are missing.
  Profiler(std::string simulate, std::string sources);
  ~Profiler();
  Profiler(const Profiler&) = delete;
  Profiler& operator=(const Profiler&) = delete;

  /// Counts the instructions of the last `counted` of `steps` steps. `scene`: YAML; `options`: further ones of
  /// `simulate`, as words of a shell; FOLDER in them stands for a folder to write into. Throws std::runtime_error when
  /// a run fails, or when the library has no line tables.
  StepProfile instructions(const std::string& scene, double step, const std::vector<std::string>& options, int steps,
                           int counted) const;

  /// All that is taken from the heap in a run of `steps` steps.
  std::vector<Allocation> allocations(const std::string& scene, double step, const std::vector<std::string>& options,
                                      int steps) const;

  /// Text of a line of the package; empty for others'.
  const std::string& text(const SourceLine& at) const;

private:
  std::string run(const std::string& tool, const std::string& scene, double step,
                  const std::vector<std::string>& options, int steps) const;

  std::string simulate_, sources_, folder_;
};

/// Of a path in line tables: what follows the package's folder, or the path itself when it is none of the package's.
std::string packagePath(const std::string& sources, const std::string& path);

/// A file of callgrind, written with --compress-strings=no --compress-pos=no; costs are added to the profile. Throws
/// std::runtime_error.
void readCallgrind(std::istream& file, const std::string& sources, StepProfile& profile);

/// A file of dhat. Throws std::runtime_error.
std::vector<Allocation> readDhat(const std::string& text, const std::string& sources);

}   // namespace slender::study
