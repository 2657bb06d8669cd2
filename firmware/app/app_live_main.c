/* isohead_live - serves the live view; started by isohead_board --view, never by hand. */
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include "app_live.h"
#include "app_live_page.h"
#include "linux/hal_serve.h"
#include "linux/hal_viewer.h"

int main(void)
{
    static const struct hal_serve_asset assets[] = {
        {"", "text/html; charset=utf-8", app_live_html, sizeof app_live_html},
        {"live.js", "text/javascript; charset=utf-8", app_live_js, sizeof app_live_js},
        {"live.css", "text/css; charset=utf-8", app_live_css, sizeof app_live_css},
    };
    const struct hal_serve_config config = {.asset = assets,
                                            .asset_count = sizeof assets / sizeof assets[0],
                                            .write = app_live_write,
                                            .answer_more = APP_LIVE_WRITE_MORE};
    struct stat about;
    if (fstat(HAL_VIEWER_SOCKET_FD, &about) != 0 || !S_ISSOCK(about.st_mode)) {
        fputs("isohead_live: started by hand; isohead_board --view PORT starts it\n", stderr);
        return 2;
    }
    /* In its jail a process has no use for what runs at a usual end. */
    _exit(hal_serve_run(&config));
}
