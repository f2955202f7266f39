/// What a node says of its machine when it joins: cores, memory, and rays per second as measured then and there.
#pragma once

#include <cstdint>
#include <string>

namespace lichthof::apps {

/// Of one core: packets of shadow rays in a furnished room. @cost 0.03 s
double measured_rays_per_s();
/// Of the machine, or of the narrowest control group around this process.
std::uint64_t total_memory_bytes();
/// What may still be taken of it without anything being written to disk.
std::uint64_t free_memory_bytes();
/// Of this process.
std::uint64_t used_memory_bytes();
/// Its host name, made fit to be a node's.
std::string machine_name();
/// ~/.cache/lichthof and ~/.local/state/lichthof, or what XDG says.
std::string cache_folder();
std::string state_folder();

}  // namespace lichthof::apps
