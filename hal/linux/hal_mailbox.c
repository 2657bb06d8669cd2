#include "linux/hal_mailbox.h"

#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hal_text.h"

#define ALIGNMENT 64

enum state { STATE_IDLE, STATE_WANTED, STATE_FULL };

struct hal_mailbox_shared {
    atomic_int state;
    char token[HAL_MAILBOX_TOKEN + 1];
    _Alignas(ALIGNMENT) unsigned char content[];
};

_Static_assert(ATOMIC_INT_LOCK_FREE == 2, "a lock would be inside one of the processes");

static bool map(struct hal_mailbox *mailbox, struct hal_error *error)
{
    void *memory =
        mmap(NULL, mailbox->mapped_size, PROT_READ | PROT_WRITE, MAP_SHARED, mailbox->fd, 0);
    if (memory == MAP_FAILED) {
        return hal_fail(error, "mailbox: no room for %zu bytes: %s", mailbox->mapped_size,
                        strerror(errno));
    }
    mailbox->shared = memory;
    return true;
}

/* Both sides close what is open after a failure. */
static bool give_up(struct hal_mailbox *mailbox)
{
    hal_mailbox_close(mailbox);
    return false;
}

static bool reserve(const struct hal_mailbox *mailbox, struct hal_error *error)
{
    int reason = posix_fallocate(mailbox->fd, 0, (off_t)mailbox->mapped_size);
    if (reason != 0) {
        return hal_fail(error, "mailbox: no memory for %zu bytes: %s", mailbox->mapped_size,
                        strerror(reason));
    }
    if (fcntl(mailbox->fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
        return hal_fail(error, "mailbox: its size cannot be fixed: %s", strerror(errno));
    }
    return true;
}

static bool draw_token(struct hal_mailbox_shared *shared, struct hal_error *error)
{
    uint64_t random[HAL_MAILBOX_TOKEN / 16];
    struct hal_text text = hal_text_begin(shared->token, sizeof shared->token);
    /* So few bytes come whole or not at all. */
    if (getrandom(random, sizeof random, 0) != (ssize_t)sizeof random) {
        return hal_fail(error, "mailbox: no random numbers: %s", strerror(errno));
    }
    for (size_t i = 0; i < sizeof random / sizeof random[0]; i++) {
        hal_text_put_hex(&text, random[i], 16);
    }
    return true;
}

bool hal_mailbox_create(struct hal_mailbox *mailbox, size_t content_size, struct hal_error *error)
{
    *mailbox = (struct hal_mailbox){.fd = -1};
    if (content_size > HAL_MAILBOX_CONTENT_MAX) {
        return hal_fail(error, "mailbox: %zu bytes, expected at most %d", content_size,
                        HAL_MAILBOX_CONTENT_MAX);
    }
    *mailbox = (struct hal_mailbox){
        .fd = memfd_create("isohead-frame", MFD_CLOEXEC | MFD_ALLOW_SEALING),
        .content_size = content_size,
        .mapped_size = sizeof(struct hal_mailbox_shared) + content_size,
    };
    if (mailbox->fd < 0) {
        return hal_fail(error, "mailbox: no memory file: %s", strerror(errno));
    }
    if (!reserve(mailbox, error) || !map(mailbox, error) || !draw_token(mailbox->shared, error)) {
        return give_up(mailbox);
    }
    /* The laser's guard, which is forked later, has nothing to do with it. */
    madvise(mailbox->shared, mailbox->mapped_size, MADV_DONTFORK);
    atomic_store(&mailbox->shared->state, STATE_IDLE);
    return true;
}

bool hal_mailbox_open(struct hal_mailbox *mailbox, int fd, struct hal_error *error)
{
    struct stat about;
    *mailbox = (struct hal_mailbox){.fd = fd};
    if (fstat(fd, &about) != 0) {
        mailbox->fd = -1;
        return hal_fail(error, "mailbox: descriptor %d: %s", fd, strerror(errno));
    }
    if (about.st_size <= (off_t)sizeof(struct hal_mailbox_shared)) {
        hal_fail(error, "mailbox: %lld bytes, expected more than %zu", (long long)about.st_size,
                 sizeof(struct hal_mailbox_shared));
        return give_up(mailbox);
    }
    mailbox->mapped_size = (size_t)about.st_size;
    mailbox->content_size = mailbox->mapped_size - sizeof(struct hal_mailbox_shared);
    return map(mailbox, error) || give_up(mailbox);
}

void *hal_mailbox_room(const struct hal_mailbox *mailbox)
{
    struct hal_mailbox_shared *shared = mailbox->shared;
    int state = atomic_load_explicit(&shared->state, memory_order_acquire);
    return state == STATE_WANTED ? shared->content : NULL;
}

void hal_mailbox_fill(const struct hal_mailbox *mailbox)
{
    atomic_store_explicit(&mailbox->shared->state, STATE_FULL, memory_order_release);
}

void hal_mailbox_want(const struct hal_mailbox *mailbox)
{
    int idle = STATE_IDLE;
    atomic_compare_exchange_strong(&mailbox->shared->state, &idle, STATE_WANTED);
}

void *hal_mailbox_content(const struct hal_mailbox *mailbox)
{
    struct hal_mailbox_shared *shared = mailbox->shared;
    int state = atomic_load_explicit(&shared->state, memory_order_acquire);
    return state == STATE_FULL ? shared->content : NULL;
}

void hal_mailbox_done(const struct hal_mailbox *mailbox)
{
    atomic_store_explicit(&mailbox->shared->state, STATE_IDLE, memory_order_release);
}

const char *hal_mailbox_token(const struct hal_mailbox *mailbox)
{
    return mailbox->shared->token;
}

void hal_mailbox_close(struct hal_mailbox *mailbox)
{
    if (mailbox->fd < 0) {
        return;
    }
    if (mailbox->shared != NULL) {
        munmap(mailbox->shared, mailbox->mapped_size);
    }
    close(mailbox->fd);
    *mailbox = (struct hal_mailbox){.fd = -1};
}
