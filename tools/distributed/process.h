#pragma once
/// Whether a process of this machine still lives.

#include <cstdint>
#include <string>

namespace hiprt::tools {

/// A process of any machine. Its start tells it from a later process with the same number.
struct ProcessId {
  std::int64_t pid = 0;
  std::uint64_t start = 0;      ///< Clock ticks from the start of the machine; 0: unknown.
  std::uint64_t pid_space = 0;  ///< Its space of process numbers (containers have their own); 0: unknown.
  std::string host{};           ///< Name and boot of the machine.

  static ProcessId own();
  /// Whether is_dead() can tell here: same machine, same space of process numbers.
  bool is_visible_to(const ProcessId& observer) const;
  /// Whether it has ended. @pre is_visible_to() this process
  bool is_dead() const;
};

/// Name of the machine, without the boot.
std::string host_name();

/// Name of the program that started this one: "mpirun". Empty if it is unknown.
std::string parent_name();

/// Whether mpirun has fewer processes of this program than it has started on this machine: one has ended. False if that
/// is unknown.
bool sibling_is_missing();

/// Whether the stderr of the program that started this one is a terminal. mpirun gives its ranks a pipe and copies it.
bool parent_shows_terminal();

}  // namespace hiprt::tools
