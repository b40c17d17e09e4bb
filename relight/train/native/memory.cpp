// Memory that libtorch gives back is asked for again a moment later, batch after batch.

#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

extern "C" void rl_keep_memory() {
#ifdef __GLIBC__
    // glibc would map large blocks anew each time, and give the top of its heap back: every page of them is then cleared by
    // the kernel again.
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, -1);
#endif
}
