/* Ends the process by signal 9 at the n-th point inside write, sync and rename of files below one folder.

   A write ends half done. A sync and a rename have two points, just before and just after.
   Built and loaded (LD_PRELOAD) by tests/safety/kill_points.py, which calls km_arm and km_seen. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <limits.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/uio.h>
#include <unistd.h>

static char below[PATH_MAX];
static size_t length;
static long wanted;
static atomic_long seen;
static __thread int inside;

void km_arm(const char *folder, long point) {
    strncpy(below, folder, sizeof below - 1);
    length = strlen(below);
    wanted = point;
    seen = 0;
}
long km_seen(void) { return seen; }

static int ours(const char *path) { return length && strncmp(path, below, length) == 0; }
static int ours_fd(int fd) {
    char link[64], path[PATH_MAX];
    if (!length || inside) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, sizeof path - 1);
    if (n < 0) return 0;
    path[n] = 0;
    return ours(path);
}
static int now(void) { return atomic_fetch_add(&seen, 1) + 1 == wanted; }
static void end(void) { kill(getpid(), SIGKILL); }
#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t write(int fd, const void *data, size_t n) {
    if (ours_fd(fd) && now()) { REAL(write)(fd, data, n / 2); end(); }
    return REAL(write)(fd, data, n);
}
ssize_t pwrite64(int fd, const void *data, size_t n, off_t at) {
    if (ours_fd(fd) && now()) { REAL(pwrite64)(fd, data, n / 2, at); end(); }
    return REAL(pwrite64)(fd, data, n, at);
}
ssize_t writev(int fd, const struct iovec *v, int count) {
    if (ours_fd(fd) && now()) { REAL(write)(fd, v[0].iov_base, v[0].iov_len / 2); end(); }
    return REAL(writev)(fd, v, count);
}
size_t fwrite(const void *data, size_t size, size_t n, FILE *file) {
    if (ours_fd(fileno(file))) {
        if (now()) { REAL(fwrite)(data, 1, size * n / 2, file); fflush(file); end(); }
        inside++;
        size_t done = REAL(fwrite)(data, size, n, file);
        inside--;
        return done;
    }
    return REAL(fwrite)(data, size, n, file);
}
int fsync(int fd) {
    int mine = ours_fd(fd);
    if (mine && now()) end();
    int result = REAL(fsync)(fd);
    if (mine && now()) end();
    return result;
}
int rename(const char *from, const char *to) {
    int mine = ours(to);
    if (mine && now()) end();
    int result = REAL(rename)(from, to);
    if (mine && now()) end();
    return result;
}
