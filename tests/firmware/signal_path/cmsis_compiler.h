/* What CMSIS-DSP's logarithms want of the CMSIS core, which is not in their package: as GCC has it. */
#pragma once
#define __STATIC_FORCEINLINE static inline __attribute__((always_inline))
#define __STATIC_INLINE static inline
#define __ALIGNED(bytes) __attribute__((aligned(bytes)))
#define __WEAK __attribute__((weak))
#define __CLZ(word) ((word) == 0 ? 32 : __builtin_clz(word))
#define __ASM __asm
