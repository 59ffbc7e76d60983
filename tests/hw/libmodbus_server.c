/* A Modbus server on libmodbus: holding registers of a stopped RD6006, for one client at a time. */
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

int main(int count, char **words) {
    uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
    modbus_mapping_t *map = modbus_mapping_new(0, 0, 120, 0);
    modbus_t *link = modbus_new_tcp("127.0.0.1", count > 1 ? atoi(words[1]) : 1502);
    if (map == NULL || link == NULL) return 1;
    map->tab_registers[0] = 60061;
    map->tab_registers[2] = 4711;
    map->tab_registers[3] = 141;
    map->tab_registers[14] = 6500;
    int listener = modbus_tcp_listen(link, 1);
    if (listener < 0) return 1;
    puts("ready");
    fflush(stdout);
    for (;;) {
        if (modbus_tcp_accept(link, &listener) < 0) return 1;
        for (;;) {
            int length = modbus_receive(link, request);
            if (length < 0) break;
            modbus_reply(link, request, length, map);
            /* what the output would do: it gives the setpoint while it is on */
            map->tab_registers[10] = map->tab_registers[18] ? map->tab_registers[8] : 0;
        }
        modbus_close(link);
    }
}
