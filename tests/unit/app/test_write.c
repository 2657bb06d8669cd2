/* app_write's strings: what is UTF-8 by RFC 3629 stays, each other byte becomes U+FFFD. */
#include "app_write.h"

#include <string.h>

#include "ih_test.h"

#define BAD "\\ufffd"

static char memory[128];

void setUp(void)
{
}

void tearDown(void)
{
}

static void assert_string(const char *text, const char *wanted)
{
    struct app_write write = {.memory = memory, .size = sizeof memory - 1};

    app_write_string(&write, text);
    TEST_ASSERT_FALSE(write.full);
    memory[write.length] = 0;
    TEST_ASSERT_EQUAL_STRING(wanted, memory);
}

static void control_characters_and_quotes_are_escaped(void)
{
    assert_string("", "\"\"");
    assert_string("a\"b\\c", "\"a\\\"b\\\\c\"");
    assert_string("\x01\n\x1f\x7f", "\"\\u0001\\u000a\\u001f\\u007f\"");
}

/* The first and the last of each length, and beside the surrogates. */
static void utf8_stays(void)
{
    static const char *const good[] = {"\xc2\x80",         "\xdf\xbf",         "\xe0\xa0\x80",
                                       "\xed\x9f\xbf",     "\xee\x80\x80",     "\xef\xbf\xbf",
                                       "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf", "a\xc3\xa9z"};

    for (int32_t i = 0; i < IH_TEST_COUNT(good); i++) {
        char wanted[16];

        snprintf(wanted, sizeof wanted, "\"%s\"", good[i]);
        assert_string(good[i], wanted);
    }
}

static void what_is_none_is_replaced(void)
{
    assert_string("\x80", "\"" BAD "\"");                                 /* nothing begins so */
    assert_string("\xc1\xbf", "\"" BAD BAD "\"");                         /* overlong */
    assert_string("\xe0\x9f\xbf", "\"" BAD BAD BAD "\"");                 /* overlong */
    assert_string("\xf0\x8f\xbf\xbf", "\"" BAD BAD BAD BAD "\"");         /* overlong */
    assert_string("\xed\xa0\x80", "\"" BAD BAD BAD "\"");                 /* a surrogate */
    assert_string("\xf4\x90\x80\x80", "\"" BAD BAD BAD BAD "\"");         /* beyond U+10FFFF */
    assert_string("\xf5\x80\x80\x80", "\"" BAD BAD BAD BAD "\"");         /* the same */
    assert_string("\xc3", "\"" BAD "\"");                                 /* cut */
    assert_string("\xe2\x82", "\"" BAD BAD "\"");                         /* cut */
    assert_string("\xe2\x82z", "\"" BAD BAD "z\"");                       /* cut by another */
    assert_string("\xf0\x9f\x98\xc3\xa9", "\"" BAD BAD BAD "\xc3\xa9\""); /* the same */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(control_characters_and_quotes_are_escaped);
    RUN_TEST(utf8_stays);
    RUN_TEST(what_is_none_is_replaced);
    return UNITY_END();
}
