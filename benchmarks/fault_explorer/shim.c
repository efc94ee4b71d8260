/* Counts the calls of one process that create, write, rename, sync or delete below one folder, and
 * makes one of them fail. Loaded by LD_PRELOAD; `control.py` writes what is to fail into a mapped
 * file, and reads there what was counted.
 *
 * A call is counted before it is made, and only if it changes something. What the C library does within itself (a buffered stdio
 * stream) cannot be seen; creation by fopen is. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#define MOST_CALLS 65536
#define LONGEST 1024

enum kind { CREATE = 1, WRITE, RENAME, SYNC, DELETE, TRUNCATE };

/* The same values as `Fault` in control.py. */
enum fault { NONE, KILL, TORN, FULL, ERROR, SHORT, INODES, READ_ONLY, STALE, PAUSE, CLOCK_BACK,
             CLOCK_FORWARD };

struct control {
    char folder[LONGEST];
    int64_t process;             /* whose calls are counted; 0: nobody's */
    int64_t at;                  /* number of the call that fails, from 1 */
    int64_t fault;
    int64_t counted;
    char call[LONGEST];          /* the call that failed */
    unsigned char kinds[MOST_CALLS]; /* of each call, in order */
};

static struct control *control;
static _Thread_local int inside; /* our own calls are not counted */

__attribute__((constructor)) static void start(void)
{
    const char *path = getenv("FAULT_CONTROL");
    int (*real_open)(const char *, int, ...) = dlsym(RTLD_NEXT, "open");
    int file = path && real_open ? real_open(path, O_RDWR | O_CLOEXEC) : -1;
    if (file < 0)
        return;
    void *mapped = mmap(NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (mapped != MAP_FAILED)
        control = mapped;
}

static int is_watched(void)
{
    return control && !inside && control->process == getpid();
}

static int is_below(const char *path)
{
    size_t length = strlen(control->folder);
    return strncmp(path, control->folder, length) == 0 &&
           (path[length] == '/' || path[length] == '\0' || path[length] == ' ');
}

static void path_of(int descriptor, char *path)
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    ssize_t length = readlink(link, path, LONGEST - 1);
    path[length < 0 ? 0 : length] = '\0';
}

static void path_at(int folder, const char *name, char *path)
{
    if (name[0] == '/') {
        snprintf(path, LONGEST, "%s", name);
        return;
    }
    if (folder != AT_FDCWD)
        path_of(folder, path);
    else if (!getcwd(path, LONGEST))
        path[0] = '\0';
    size_t length = strlen(path);
    snprintf(path + length, LONGEST - length, "/%s", name);
}

/* What is to be done with a call. */
enum answer { MAKE, REFUSE, HALVE, MAKE_AND_REFUSE };

static int needs_room(enum kind kind)
{
    return kind == CREATE || kind == WRITE || kind == SYNC;
}

/* Refuse what comes after the call that failed, where the fault lasts. */
static enum answer later(enum fault fault, enum kind kind)
{
    if ((fault == FULL && needs_room(kind)) || (fault == INODES && kind == CREATE)) {
        errno = ENOSPC;
        return REFUSE;
    }
    if (fault == READ_ONLY && kind != SYNC) {
        errno = EROFS;
        return REFUSE;
    }
    return MAKE;
}

static enum answer count(enum kind kind, const char *name, const char *path)
{
    if (!is_below(path))
        return MAKE;
    int64_t number = __atomic_add_fetch(&control->counted, 1, __ATOMIC_SEQ_CST);
    if (number <= MOST_CALLS)
        control->kinds[number - 1] = kind;
    if (!control->at || number < control->at)
        return MAKE;
    enum fault fault = control->fault;
    if (number > control->at)
        return later(fault, kind);
    snprintf(control->call, LONGEST, "%s %s", name, path);
    switch (fault) {
    case KILL:
        kill(getpid(), SIGKILL);
        return MAKE;
    case PAUSE:
        kill(getpid(), SIGSTOP);
        return MAKE;
    case ERROR:
        errno = EIO;
        return REFUSE;
    case STALE:
        errno = ESTALE;
        return MAKE_AND_REFUSE;
    case TORN:
    case SHORT:
        return HALVE;
    default:
        return later(fault, kind);
    }
}

/* After the half of a write that was made: die there, if that is the fault. */
static void after_half(void)
{
    if (control->fault == TORN)
        kill(getpid(), SIGKILL);
}

static int exists(const char *path)
{
    return faccessat(AT_FDCWD, path, F_OK, AT_SYMLINK_NOFOLLOW) == 0;
}

/* Whether a call changes anything: not to delete what is missing, to create what exists, or to
 * create in a folder that is missing. */
static int changes(enum kind kind, const char *path)
{
    if (kind == DELETE)
        return exists(path);
    if (kind != CREATE)
        return 1;
    char parent[LONGEST];
    snprintf(parent, LONGEST, "%s", path);
    char *end = strrchr(parent, '/');
    if (end)
        *end = '\0';
    return !exists(path) && exists(parent);
}

static enum answer count_at(enum kind kind, const char *name, int folder, const char *path)
{
    if (!is_watched() || !path)
        return MAKE;
    int before = errno;
    inside = 1;
    char whole[LONGEST];
    path_at(folder, path, whole);
    int counts = !strcmp(name, "open") || !strcmp(name, "fopen") || changes(kind, whole);
    errno = before;
    enum answer answer = counts ? count(kind, name, whole) : MAKE;
    inside = 0;
    return answer;
}

static enum answer count_open(enum kind kind, const char *name, int descriptor)
{
    if (!is_watched())
        return MAKE;
    int before = errno;
    inside = 1;
    char path[LONGEST];
    path_of(descriptor, path);
    errno = before;
    enum answer answer = count(kind, name, path);
    inside = 0;
    return answer;
}

#define REAL(type, name, ...)                                                                      \
    static type (*real)(__VA_ARGS__);                                                              \
    if (!real)                                                                                     \
    real = (type(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name)

/* A call by a path, of which the result is 0 or -1. */
#define BY_PATH(kind, name, folder, path, made)                                                    \
    switch (count_at(kind, name, folder, path)) {                                                  \
    case REFUSE:                                                                                   \
        return -1;                                                                                 \
    case MAKE_AND_REFUSE:                                                                          \
        if ((made) == 0)                                                                           \
            errno = ESTALE;                                                                        \
        return -1;                                                                                 \
    default:                                                                                       \
        return made;                                                                               \
    }

static int creates(int folder, const char *path, int flags)
{
    if ((flags & O_TMPFILE) == O_TMPFILE || flags & O_TRUNC)
        return 1;
    return flags & O_CREAT && is_watched() && faccessat(folder, path, F_OK, 0) != 0;
}

#define OPEN(symbol, folder, real_arguments, ...)                                                  \
    int symbol(__VA_ARGS__, int flags, ...)                                                        \
    {                                                                                              \
        mode_t mode = 0;                                                                           \
        if (flags & O_CREAT || (flags & O_TMPFILE) == O_TMPFILE) {                                 \
            va_list list;                                                                          \
            va_start(list, flags);                                                                 \
            mode = va_arg(list, mode_t);                                                           \
            va_end(list);                                                                          \
        }                                                                                          \
        REAL(int, #symbol, __VA_ARGS__, int, ...);                                                 \
        int before = errno;                                                                        \
        int is_new = creates(folder, path, flags);                                                 \
        errno = before;                                                                            \
        if (is_new && count_at(CREATE, "open", folder, path) == REFUSE)                            \
            return -1;                                                                             \
        return real real_arguments;                                                                \
    }
OPEN(open, AT_FDCWD, (path, flags, mode), const char *path)
OPEN(open64, AT_FDCWD, (path, flags, mode), const char *path)
OPEN(openat, folder, (folder, path, flags, mode), int folder, const char *path)
OPEN(openat64, folder, (folder, path, flags, mode), int folder, const char *path)

#define FOPEN(symbol)                                                                              \
    FILE *symbol(const char *path, const char *mode)                                               \
    {                                                                                              \
        REAL(FILE *, #symbol, const char *, const char *);                                         \
        int is_new = mode[0] == 'w' ||                                                             \
                     (mode[0] == 'a' && is_watched() && access(path, F_OK) != 0);                  \
        if (is_new && count_at(CREATE, "fopen", AT_FDCWD, path) == REFUSE)                         \
            return NULL;                                                                           \
        return real(path, mode);                                                                   \
    }
FOPEN(fopen)
FOPEN(fopen64)

/* A call that writes `size` bytes, and may write fewer. */
#define WRITES(symbol, made, half, size, ...)                                                      \
    ssize_t symbol(__VA_ARGS__)                                                                    \
    {                                                                                              \
        REAL(ssize_t, #symbol, __VA_ARGS__);                                                       \
        enum answer answer = count_open(WRITE, #symbol, file);                                     \
        if (answer == REFUSE)                                                                      \
            return -1;                                                                             \
        if (answer == HALVE && (size) > 1) {                                                       \
            inside = 1;                                                                            \
            ssize_t written = half;                                                                \
            inside = 0;                                                                            \
            after_half();                                                                          \
            return written;                                                                        \
        }                                                                                          \
        ssize_t written = made;                                                                    \
        if (answer == HALVE)                                                                       \
            after_half();                                                                          \
        return written;                                                                            \
    }
WRITES(write, real(file, data, n), real(file, data, n / 2), n, int file, const void *data, size_t n)
WRITES(pwrite, real(file, data, n, to), real(file, data, n / 2, to), n, int file, const void *data,
       size_t n, off_t to)
WRITES(pwrite64, real(file, data, n, to), real(file, data, n / 2, to), n, int file,
       const void *data, size_t n, off64_t to)
/* Of several parts, the first half of the first. */
WRITES(writev, real(file, parts, n), write(file, parts->iov_base, parts->iov_len / 2),
       n > 0 ? parts->iov_len : 0, int file, const struct iovec *parts, int n)
WRITES(sendfile, real(file, from, at, n), real(file, from, at, n / 2), n, int file, int from,
       off_t *at, size_t n)
WRITES(sendfile64, real(file, from, at, n), real(file, from, at, n / 2), n, int file, int from,
       off64_t *at, size_t n)

ssize_t copy_file_range(int from, off64_t *at, int file, off64_t *to, size_t n, unsigned flags)
{
    REAL(ssize_t, "copy_file_range", int, off64_t *, int, off64_t *, size_t, unsigned);
    enum answer answer = count_open(WRITE, "copy_file_range", file);
    if (answer == REFUSE)
        return -1;
    ssize_t written = real(from, at, file, to, answer == HALVE && n > 1 ? n / 2 : n, flags);
    if (answer == HALVE)
        after_half();
    return written;
}

#define ON_OPEN(symbol, kind, made, ...)                                                           \
    int symbol(__VA_ARGS__)                                                                        \
    {                                                                                              \
        REAL(int, #symbol, __VA_ARGS__);                                                           \
        return count_open(kind, #symbol, file) == REFUSE ? -1 : made;                              \
    }
ON_OPEN(fsync, SYNC, real(file), int file)
ON_OPEN(fdatasync, SYNC, real(file), int file)
ON_OPEN(ftruncate, TRUNCATE, real(file, size), int file, off_t size)
ON_OPEN(ftruncate64, TRUNCATE, real(file, size), int file, off64_t size)
ON_OPEN(fallocate, WRITE, real(file, mode, at, size), int file, int mode, off_t at, off_t size)
ON_OPEN(fallocate64, WRITE, real(file, mode, at, size), int file, int mode, off64_t at,
        off64_t size)

#define ON_PATH(symbol, kind, folder, path, made, ...)                                             \
    int symbol(__VA_ARGS__)                                                                        \
    {                                                                                              \
        REAL(int, #symbol, __VA_ARGS__);                                                           \
        BY_PATH(kind, #symbol, folder, path, made)                                                 \
    }
ON_PATH(truncate, TRUNCATE, AT_FDCWD, path, real(path, size), const char *path, off_t size)
ON_PATH(mkdir, CREATE, AT_FDCWD, path, real(path, mode), const char *path, mode_t mode)
ON_PATH(mkdirat, CREATE, folder, path, real(folder, path, mode), int folder, const char *path,
        mode_t mode)
ON_PATH(mkfifo, CREATE, AT_FDCWD, path, real(path, mode), const char *path, mode_t mode)
ON_PATH(rmdir, DELETE, AT_FDCWD, path, real(path), const char *path)
ON_PATH(unlink, DELETE, AT_FDCWD, path, real(path), const char *path)
ON_PATH(remove, DELETE, AT_FDCWD, path, real(path), const char *path)
ON_PATH(unlinkat, DELETE, folder, path, real(folder, path, flags), int folder, const char *path,
        int flags)
ON_PATH(rename, RENAME, AT_FDCWD, to, real(from, to), const char *from, const char *to)
ON_PATH(renameat, RENAME, folder, to, real(old, from, folder, to), int old, const char *from,
        int folder, const char *to)
ON_PATH(renameat2, RENAME, folder, to, real(old, from, folder, to, flags), int old,
        const char *from, int folder, const char *to, unsigned flags)
ON_PATH(link, CREATE, AT_FDCWD, to, real(from, to), const char *from, const char *to)
ON_PATH(linkat, CREATE, folder, to, real(old, from, folder, to, flags), int old, const char *from,
        int folder, const char *to, int flags)
ON_PATH(symlink, CREATE, AT_FDCWD, path, real(target, path), const char *target, const char *path)
ON_PATH(symlinkat, CREATE, folder, path, real(target, folder, path), const char *target,
        int folder, const char *path)

/* Seconds that the clock is off by, once the call has come. */
static time_t jump(void)
{
    if (!is_watched() || !control->at || control->counted < control->at)
        return 0;
    if (control->fault == CLOCK_BACK)
        return -86400;
    return control->fault == CLOCK_FORWARD ? 86400 : 0;
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    REAL(int, "clock_gettime", clockid_t, struct timespec *);
    int result = real(clock, now);
    if (result == 0 && clock == CLOCK_REALTIME)
        now->tv_sec += jump();
    return result;
}

int gettimeofday(struct timeval *now, void *zone)
{
    REAL(int, "gettimeofday", struct timeval *, void *);
    int result = real(now, zone);
    if (result == 0)
        now->tv_sec += jump();
    return result;
}

time_t time(time_t *place)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (place)
        *place = now.tv_sec;
    return now.tv_sec;
}
