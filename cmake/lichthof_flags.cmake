# Flags that every target of the project shares.
add_library(lichthof_flags INTERFACE)
target_include_directories(lichthof_flags INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(lichthof_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
  # g++ 12 sees overlapping copies in any `"text" + string` (GCC bug 105651).
  -Wno-restrict
  # Every x86-64-v2 machine runs the binary; wider vector code is chosen at run time (core/light/kernels).
  -march=x86-64-v2
  # No fused multiply-add behind our back: the same bits on every machine and vector width.
  -ffp-contract=off)
target_compile_definitions(lichthof_flags INTERFACE GLM_FORCE_XYZW_ONLY CAF_ENABLE_TYPE_ID_CHECKS
  $<$<BOOL:${LICHTHOF_AUDIT}>:LICHTHOF_AUDIT>)
if(LICHTHOF_WERROR)
  target_compile_options(lichthof_flags INTERFACE -Werror)
endif()
if(LICHTHOF_SANITIZE)
  # g++ 12 takes members of variants for uninitialised once sanitizers have split its functions.
  target_compile_options(lichthof_flags INTERFACE -Wno-error=maybe-uninitialized)
  list(JOIN LICHTHOF_SANITIZE "," sanitizers)
  target_compile_options(lichthof_flags INTERFACE -fsanitize=${sanitizers} -fno-omit-frame-pointer)
  target_link_options(lichthof_flags INTERFACE -fsanitize=${sanitizers})
  if(sanitizers MATCHES undefined)
    # CAF binds null references for actors spawned without arguments, and its queues cast their end mark to a message.
    target_compile_options(lichthof_flags INTERFACE -fno-sanitize=null,vptr)
  endif()
endif()
