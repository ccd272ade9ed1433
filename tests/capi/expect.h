/* What a test expects; the first that is not so ends the program with an error. */
#ifndef EXPECT_H
#define EXPECT_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPECT(condition) \
    ((condition) ? (void)++expectations : (fprintf(stderr, "%s:%d: expected %s\n", __FILE__, __LINE__, #condition), exit(1)))

static int expectations;

#endif
